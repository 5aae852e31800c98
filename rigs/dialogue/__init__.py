"""The driver of simple controllers, whose dialogue the rig file describes."""
