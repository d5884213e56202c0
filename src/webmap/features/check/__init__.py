"""The check before driving, on the card of a robot.

Open ``check.py`` first: it has the steps and the lines of a check, without I/O.
``check_panel.py`` shows the last check of each robot, and keeps it.
"""
