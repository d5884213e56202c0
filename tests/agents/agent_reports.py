"""A report of a robot that a page of a display controls."""

import msgspec

from webmap.gate.protocol import RobotReport

NAME = "ann.4f"
"""The name of the display."""

REPORT = msgspec.convert(
    {
        "type": "robot",
        "robot": "r1",
        "name": "Bob",
        "state": "driving",
        "doing": "driven",
        "latched": False,
        "stop": None,
        "holder": {"connection": f"{NAME}/c1", "name": "Ann"},
        "epoch": 3,
        "asker": None,
        "changing": False,
        "armed": True,
        "v": 1.0,
        "w": 1.5,
        "why": [],
        "link": "up",
        "sent": [0.0] * 6,
        "echoed": None,
        "measured": None,
        "alarm": None,
        "age": None,
        "reaction": 0.3,
        "brake": 0.5,
        "stop_time": None,
        "stop_source": None,
        "stop_date": None,
        "test": None,
        "armable": True,
        "reason": None,
    },
    RobotReport,
)
