"""Several robots at once: selecting them by a box, and what can be done with them.

Open ``several_robots.py`` for what a page may ask, ``several_robots.js`` for the box
and the buttons.
"""
