"""The plan of a room, seen from above."""
