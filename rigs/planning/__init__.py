"""rigs/planning."""
