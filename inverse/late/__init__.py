"""Late sound and what a room makes of energy, tile by tile."""
