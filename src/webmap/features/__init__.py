"""Features: each folder is one thing that an operator can name.

The Python, JavaScript and CSS of a feature are together. A file that is named after
its class is a built-in module: ``measure_tool.py`` has ``MeasureTool``, which
``map.add_module("MeasureTool")`` adds. The class registers itself with ``map_modules``
or ``robot_modules``. Several modules of one subject may share a file; :data:`FILES` has
their names. A feature imports no other feature: shared Python belongs in
``webmap.modules``, shared JavaScript in ``web/tools``. Open ``measure/`` first, which
has one Python, one JavaScript and one CSS file.
"""

FILES = {
    "Follow": "view.view",
    "GoalTool": "goals.goals",
    "HttpCamera": "cameras.camera",
    "InitialPoseTool": "goals.goals",
    "LayerSwitches": "view.view",
    "MapViewControl": "view.view",
    "MetreGrid": "view.view",
    "MouseViewControl": "view.view",
    "PointerReadout": "view.view",
    "RosoutPanel": "log.rosout",
    "ScaleBar": "view.view",
    "ShowSelected": "view.view",
}
"""The file of each module that is not in a file of its own name."""
