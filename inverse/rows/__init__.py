"""Measured rows, and what is read from them before any wall is known."""
