"""Walls found by ear: scans, boxes, cells, openings."""
