"""Firmware models: they answer like real motion controllers and move in time."""
