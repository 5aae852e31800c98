"""Measured rows, and what they tell before any wall is known."""
