"""Where a machine stands in the room, how exactly it comes back, when it is quiet."""
