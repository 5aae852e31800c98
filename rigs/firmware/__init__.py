"""Models of motion controllers: they answer like real ones and move in time."""
