"""rigs/operation."""
