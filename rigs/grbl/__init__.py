"""The driver of Grbl 1.1 and grblHAL boards: dialogue, states, motion."""
