"""rigs/grbl."""
