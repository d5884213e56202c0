"""Routes: lists of goals, and areas that are covered in sweeps.

Open ``route_tool.py`` first; ``route_run.js`` sends one goal after the other.
"""
