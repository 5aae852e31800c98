"""Predictions where paths explain little: rows, late sound, direct levels."""
