"""Building blocks of the networks; importing this folder's files needs torch."""
