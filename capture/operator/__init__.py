"""capture/operator."""
