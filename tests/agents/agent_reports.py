"""A report of a robot that a page of a display controls."""

from equipment.gate_reports import robot_report
from webmap.gate.protocol import Holder

NAME = "ann.4f"
"""The name of the display."""

REPORT = robot_report(
    state="driving",
    doing="driven",
    holder=Holder(f"{NAME}/c1", "Ann"),
    epoch=3,
    armed=True,
    w=1.5,
)
