"""The bench of the state machine: the gate's bench, with the pace of the real shell.

Thousands of schedules run on it. So it keeps the newest report of each robot instead of
searching for the report each time.
"""

from dataclasses import dataclass, field

from equipment.gate_harness import Bench
from webmap.gate import events, protocol
from webmap.gate.process import IDLE_STEP, STEP

BEAT = 0.05
"""Seconds between two heartbeats of the display, and between two answers of a link."""


@dataclass
class PacedBench(Bench):
    """A bench with the steps of the shell: longer steps while no robot is driven."""

    beat_at: float = float("-inf")
    each_at: float = float("-inf")
    newest: dict[str, protocol.RobotReport] = field(default_factory=dict)
    """The newest report of each robot."""

    def run(self, seconds, each=None, step=STEP):
        """Let time pass; ``each`` is called every 50 ms, before the gate's own step."""
        end, self.each_at = self.now + seconds - 1e-6, float("-inf")
        while self.now < end:
            idle = each is None and not self.gate.busy
            pace = max(step, IDLE_STEP) if idle else step
            self.now += min(pace, end + 2e-6 - self.now)
            if self.now >= self.beat_at + BEAT - 1e-6:
                self.beat_at = self.now
                if self.beating:
                    self.handle(protocol.Heartbeat())
                if self.answering and self.up:
                    self.handle(
                        events.PingAnswered(
                            next(iter(self.gate._machines._by_key)).url, self.now
                        )
                    )
            if each is not None and self.now >= self.each_at + BEAT - 1e-6:
                self.each_at = self.now
                each()
            self._do(self.gate.step(self.now))
            while self.to_keep:
                self.keep(self.to_keep.pop(0))

    def _do(self, todo):
        if todo:
            super()._do(todo)

    def report(self, robot="r1"):
        """Return the newest report of a robot."""
        for message in self.messages:
            if isinstance(message, protocol.RobotReport):
                self.newest[message.robot] = message
        self.messages.clear()
        return self.newest[robot]
