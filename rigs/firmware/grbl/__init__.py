"""Grbl 1.1h as a model."""
