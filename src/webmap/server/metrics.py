"""The figures of this process in the format of Prometheus."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from webmap.base.counts import counts
from webmap.base.errors import WebMapError
from webmap.core.robot_state import STATE_TEXTS
from webmap.server.health import Figures, Findings

MOST_NAMED = 200
"""Robots, and bridges, that have figures of their own; all are in the sums."""

try:
    from prometheus_client import CollectorRegistry, ProcessCollector
    from prometheus_client.core import (
        CounterMetricFamily,
        GaugeMetricFamily,
        Metric,
    )
    from prometheus_client.exposition import choose_encoder
    from prometheus_client.registry import Collector
except ImportError:
    raise WebMapError(
        "metrics need prometheus-client, which is not installed: "
        "pip install 'webmap[metrics]'"
    ) from None

STATES = [name for name in STATE_TEXTS if not name.endswith("_by_you")]


def rendered(
    found: Findings, pages: int, viewers: int, accept: str
) -> tuple[bytes, str]:
    """Return the figures as text, and its media type.

    Args:
        found: What was found in this process.
        pages: The number of open pages.
        viewers: The number of people who have them open.
        accept: The formats that the client reads: its Accept header.

    """
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Now(_of_process(found, pages, viewers)))
    ProcessCollector(registry=registry)
    if found.figures is not None:
        registry.register(_Now(_of_model(found.figures)))
        if (pid := found.figures.gate_pid) is not None:
            ProcessCollector("webmap_gate", lambda: pid, registry=registry)
    encode, media_type = choose_encoder(accept)
    return encode(registry), media_type


class _Now(Collector):
    def __init__(self, families: Iterable[Metric]) -> None:
        self._families = families

    def collect(self) -> Iterable[Metric]:
        return self._families


def _of_process(found: Findings, pages: int, viewers: int) -> Iterator[Metric]:
    yield _gauge("healthy", "Whether /healthz answers ok.", not found.problems)
    yield _gauge("pages", "Open pages.", pages)
    yield _gauge("viewers", "People with open pages.", viewers)
    for name, text in {
        "sent_bytes": "Bytes sent to pages over their sockets.",
        "skipped_frames": "Frames not made because a page had not answered others.",
        "stalled_pages": "Pages that were closed because they read nothing.",
    }.items():
        yield CounterMetricFamily(f"webmap_{name}", text, counts[name])


def _of_model(figures: Figures) -> Iterator[Metric]:
    robots, bridges = figures.robots, figures.bridges
    yield CounterMetricFamily(
        "webmap_refused_messages",
        "Messages and commands of pages that were refused.",
        figures.refused,
    )
    running = figures.tick_age is not None
    yield _gauge("gate_up", "Whether the gate runs.", running)
    yield _gauge(
        "gate_tick_gap_seconds",
        "Longest time between two ticks of the gate in the last 15 to 30 s; "
        "0.05 is usual.",
        figures.tick_gap,
    )
    stopped = sum(robot.stopped for robot in robots)
    yield _gauge("stops", "Robots with an active STOP.", stopped)
    states = Counter(robot.state for robot in robots)
    yield _gauge(
        "robots",
        "Robots by what they do.",
        [(name, states[name]) for name in STATES],
        "state",
    )
    reported = Counter(name for robot in robots for name in robot.conditions)
    yield _gauge(
        "robot_conditions",
        "Robots by what needs attention besides.",
        [(name, reported[name]) for name in STATES],
        "condition",
    )
    named = robots[:MOST_NAMED]
    ages = [(r.name, r.pose_age) for r in named if r.pose_age is not None]
    yield _gauge(
        "robot_pose_age_seconds", "Age of the newest pose of a robot.", ages, "robot"
    )
    marks = [(r.name, r.stopped) for r in named]
    yield _gauge("robot_stopped", "Whether STOP is active.", marks, "robot")
    links = [(b.name, b.is_open) for b in bridges[:MOST_NAMED]]
    yield _gauge("bridge_open", "Whether a bridge is connected.", links, "bridge")
    lags = [(b.name, b.lag) for b in bridges[:MOST_NAMED] if b.is_open]
    text = "Time that a bridge takes to answer."
    yield _gauge("bridge_lag_seconds", text, lags, "bridge")


def _gauge(
    name: str, text: str, values: float | Sequence[tuple[str, float]], label: str = ""
) -> Metric:
    family = GaugeMetricFamily(f"webmap_{name}", text, labels=[label] if label else [])
    for of, value in [("", values)] if isinstance(values, int | float) else values:
        family.add_metric([of] if label else [], value)
    return family
