"""The driver of Marlin boards: numbered lines, states, motion."""
