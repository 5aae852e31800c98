"""Where carriers may be and how they get there: reach, ways, joint moves, order."""
