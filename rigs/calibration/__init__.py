"""rigs/calibration."""
