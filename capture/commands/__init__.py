"""capture/commands."""
