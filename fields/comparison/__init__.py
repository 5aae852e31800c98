"""Models x forms x seeds over data sets: what train-field compare runs."""
