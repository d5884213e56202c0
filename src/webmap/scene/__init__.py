"""The scene: SVG and HTML elements as a tree in Python that says what changed.

Begin with ``element``; ``fragment`` keeps the changes, and ``svg`` and ``html`` make
elements. Nothing here knows a browser, a robot or a map.
"""
