"""The commands of the package, one a file."""
