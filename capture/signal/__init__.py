"""The arithmetic of sweeps: make them, divide by them, find their echoes and clocks."""
