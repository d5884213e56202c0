"""An alias of ``MouseViewControl``, the name in the report of 2012."""

from webmap.core.registry import map_modules
from webmap.features.view.mouse_view_control import MouseViewControl

MapViewControl = map_modules.register(MouseViewControl, name="MapViewControl")
