"""Reciprocity as a loss on a field's own predictions; needs torch."""
