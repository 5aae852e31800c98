"""capture/devices."""
