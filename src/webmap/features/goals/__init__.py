"""Goals and initial poses: an operator points on the map, and the robot gets a pose.

Open ``goal_tool.js`` first; ``goals.py`` has the modules of both tools. The gate sends
goals to robots.
"""
