"""The training harness; importing this folder's files needs torch."""
