"""rigs/marlin."""
