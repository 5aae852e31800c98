"""rigs/dialogue."""
