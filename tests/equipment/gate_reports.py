"""Reports of a robot as a gate makes them."""

from typing import Any

from webmap.gate.protocol import RobotReport


def robot_report(**changed: Any) -> RobotReport:
    """Return the report of a free robot; ``changed`` replaces some of its fields."""
    free: dict[str, Any] = {
        "robot": "r1",
        "name": "Bob",
        "state": "free",
        "doing": "free",
        "latched": False,
        "stop": None,
        "holder": None,
        "epoch": None,
        "asker": None,
        "changing": False,
        "armed": False,
        "v": 1.0,
        "w": 1.0,
        "why": (),
        "link": "up",
        "sent": (0.0,) * 6,
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
    }
    return RobotReport(**(free | changed))
