"""Volume rendering of acoustic fields; importing this folder's files needs torch."""
