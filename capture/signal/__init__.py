"""capture/signal."""
