"""Features: each folder is one thing that an operator can name.

The Python, JavaScript and CSS of a feature are together. A file that is named after
its class is a built-in module: ``scale_bar.py`` has ``ScaleBar``, which
``map.add_module("ScaleBar")`` adds. The class registers itself with ``map_modules`` or
``robot_modules``. A feature imports no other feature: shared Python belongs in
``webmap.modules``, shared JavaScript in ``web/tools``. Open ``measure/`` first, which
has one Python, one JavaScript and one CSS file.
"""
