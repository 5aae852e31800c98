"""The path field: walls found by ear, mirror images and what they leave over."""
