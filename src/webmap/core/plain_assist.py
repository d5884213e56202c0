"""Scan assist as plain data, as ``set_scan_assist`` takes it."""

import math
from typing import Literal

import msgspec

from webmap.gate.messages import AssistSpec


class ScanAssistData(msgspec.Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The arguments of ``set_scan_assist``."""

    topic: str
    footprint: list[tuple[float, float]] | float
    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0
    upside_down: bool = False
    frame: str = ""
    stop_distance: float = 0.15
    brake: float = 0.5
    blind: Literal["stop", "creep"] = "stop"
    creep: float = 0.1


def assist_data(assist: AssistSpec | None) -> ScanAssistData | None:
    """Return what sets scan assist as it is; a radius has become corners."""
    if assist is None:
        return None
    x, y, yaw = assist.sensor
    return ScanAssistData(
        assist.topic,
        list(assist.footprint),
        x,
        y,
        round(math.degrees(yaw), 9),  # so that 30 degrees are 30 again
        assist.upside_down,
        assist.frame,
        assist.stop_distance,
        assist.brake,
        assist.blind,
        assist.creep,
    )
