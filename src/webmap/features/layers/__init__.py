"""Layers: one file for each kind of message that is drawn on the map.

Open ``point_stamped.py`` first, which is the shortest. The section *A new layer* of
``docs/explanation/design.md`` lists what a new layer needs. The base classes are in
``webmap.modules``.
"""
