"""The scene: SVG and HTML elements as a tree in Python that records its changes.

Open ``element`` first; ``node`` keeps the changes, and ``svg`` and ``html`` make
elements. Nothing here knows a browser, a robot or a map.
"""
