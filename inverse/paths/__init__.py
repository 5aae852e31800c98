"""Rooms of mirror images, and their fits."""
