"""Boxes whose walls and devices change from half octave to half octave."""
