"""What answers where paths do not, and which of it is believed."""
