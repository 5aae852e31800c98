"""The compiled core of the decay analysis: noise model, curve, straight lines."""
