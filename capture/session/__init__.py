"""capture/session."""
