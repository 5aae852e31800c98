"""What stands in a room: small objects and what is in the way."""
