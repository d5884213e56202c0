"""Layers: one file for each kind of message that is drawn on the map.

Open ``point_stamped.py`` first, which is the shortest. A new layer is one new file here
and its test. The base classes are in ``webmap.modules``.
"""
