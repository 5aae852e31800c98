"""inverse/plan."""
