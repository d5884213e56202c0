"""The scans of one machine, and what they leave of its commands (S17). No I/O."""

import msgspec

from webmap.base.geometry import Twist
from webmap.gate.events import Sweep
from webmap.gate.rules.assist import FREE, Verdict, assist
from webmap.gate.rules.robots import Robots

MIXED = 2.0
"""Seconds for which no scan of a topic counts after its frame was seen to change."""


class Guard:
    """Keeps the newest scans of one machine and slows it down before what they see.

    Args:
        robots: The robots that are the machine; each may have a scanner.

    """

    def __init__(self, robots: Robots) -> None:
        self._robots = robots
        self._sweeps: dict[str, Sweep] = {}
        self._changed: dict[str, float] = {}
        """When the frame of a topic's scans was last another than before."""
        self._verdict = FREE

    @property
    def why(self) -> tuple[str, ...]:
        """Why the last command was not let through as it was, in words."""
        return () if self._verdict.why is None else (self._verdict.why,)

    def saw(self, topic: str, sweep: Sweep) -> None:
        """Note that a scan came; of a topic where two scanners speak none counts."""
        before = self._sweeps.get(topic)
        if before is not None and before.frame != sweep.frame:
            self._changed[topic] = sweep.arrived
        changed = self._changed.get(topic)
        if changed is not None and sweep.arrived - changed < MIXED:
            sweep = msgspec.structs.replace(
                sweep, refused="the scans have two different frames"
            )
        self._sweeps[topic] = sweep

    def forget(self) -> None:
        """Know nothing of before: nobody listens to the scans any more."""
        self._sweeps.clear()
        self._changed.clear()
        self._verdict = FREE

    def limit(self, wanted: Twist, now: float) -> Twist:
        """Return what every scanner's robot may do of a velocity."""
        verdict = min(
            (
                assist(spec.assist, self._sweeps.get(spec.assist.topic), wanted, now)
                for spec in self._robots.specs.values()
                if spec.assist is not None
            ),
            key=_scale,
            default=FREE,
        )
        self._verdict = verdict
        if verdict.scale >= 1.0:
            return wanted
        s = verdict.scale
        return Twist(*(s * part for part in wanted.numbers))


def _scale(verdict: Verdict) -> float:
    return verdict.scale
