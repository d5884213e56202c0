"""Aligning maps: an operator moves and turns the map of a bridge or a robot.

Open ``align_tool.py`` first; ``align_tool.js`` is the part in the browser. The
alignments themselves are in ``webmap.poses.alignment``.
"""
