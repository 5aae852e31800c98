"""Compiled inner loops; import these only where sound is computed."""
