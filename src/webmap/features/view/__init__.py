"""The view: moving and zooming, following a robot, grid, scale bar and layer switches.

Open ``mouse_view_control.js`` first; ``view.py`` has the Python of all these modules.
The map itself is in ``web/map.js``.
"""
