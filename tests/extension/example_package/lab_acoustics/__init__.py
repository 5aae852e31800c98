"""A laboratory's own parts, each one file and one entry point."""
