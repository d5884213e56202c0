"""A scan of many beams as one of at most 720, so that judging it costs little. No I/O.

The gate judges a scan with every command, and all its robots wait for that. So a dense
scan is folded once, when it comes. A beam of the fold stands for the beams up to its
neighbours on either side: it says the least of what they hit. So each hit of the scan
lies on a beam of the fold, or between two that say at least as near: a hit can move
aside, at a range r by less than r times the fold's step, but only to both sides at
once, and never out of the way of a robot that is wider than that. What is free beside
a hit looks narrower by as much: with 720 beams or more all around, less than a degree.

What a scanner sees of its own robot is left out only when the scan is judged. Behind
such a hit may lie others, of the same beam of the fold: the nearest of the next three
things, each two centimetres or more behind the one before it, are kept too.
"""

import math
from collections.abc import Sequence

import msgspec

from webmap.gate.events import Fold, Sweep

MOST = 720
"""The most beams of a scan that is judged."""

LIMIT = 100_000
"""The most beams of a scan that is looked at."""

DEPTH = 0.02
"""How far behind the nearest hit another is another thing, in metres."""

_THINGS = 4
_MOST_TURNS = 2.0


def folded(sweep: Sweep) -> Sweep:
    """Return a scan of at most 720 beams that says nothing farther than this one.

    One of more than 100,000 beams, or a dense one that goes round more than twice, is
    returned without ranges and with the reason in ``refused``.
    """
    count = len(sweep.ranges)
    if count <= MOST:
        return sweep
    if reason := _refusal(count, sweep.angle_increment):
        return _without(sweep, reason)
    each = math.ceil((count - 1) / (MOST - 1))
    return _folded(sweep, each)


def too_long(count: int) -> str | None:
    """Return in words why a scan of so many beams is not looked at."""
    if count <= LIMIT:
        return None
    return f"the scan has {count} beams, more than {LIMIT}"


def _refusal(count: int, step: float) -> str | None:
    if abs(step) * count > _MOST_TURNS * math.tau:
        return f"the {count} beams of the scan cover more than two turns"
    return too_long(count)


def _without(sweep: Sweep, reason: str) -> Sweep:
    return msgspec.structs.replace(sweep, ranges=(), refused=reason)


def _folded(sweep: Sweep, each: int) -> Sweep:
    ranges, near = sweep.ranges, sweep.range_min
    first, behind, said, asked = [], [], [], []
    before: list[float] = []
    for start in range(0, len(ranges) + each - 1, each):
        group = ranges[start : start + each]
        known = _saying(group, near)
        hits = _hits(group, near)
        nearest, *others = _things([*before, *hits]) or (math.inf,)
        unknown = nearest == math.inf and 2 * known < len(group)
        first.append(math.nan if unknown else nearest)
        behind.append(others)
        said.append(known)
        asked.append(len(group))
        # The beam that stands where the fold's does is no neighbour of the next one.
        before = hits[1:] if _hits(group[:1], near) else hits
    return msgspec.structs.replace(
        sweep,
        angle_increment=sweep.angle_increment * each,
        ranges=first,
        fold=Fold(each, len(ranges), behind, said, asked),
    )


def _hits(group: Sequence[float], near: float) -> list[float]:
    """Return what beams hit; ``-inf``, too near to measure, is a hit."""
    return [r for r in group if near <= r < math.inf or r == -math.inf]


def _saying(group: Sequence[float], near: float) -> int:
    """Return how many beams say anything."""
    return sum([_says_something(r, near) for r in group])


def known(sweep: Sweep, rays: Sequence[int]) -> tuple[int, int]:
    """Return how many of these rays say anything, and of how many.

    Of a fold it is the rays that were folded that are counted.
    """
    if (fold := sweep.fold) is not None:
        return sum(fold.said[ray] for ray in rays), sum(fold.asked[ray] for ray in rays)
    return _saying([sweep.ranges[ray] for ray in rays], sweep.range_min), len(rays)


def _says_something(reach: float, near: float) -> bool:
    """Return whether a beam says anything, be it that nothing is there."""
    # Below the least range lies what a covered scanner says; -inf is a driver's word.
    return math.isinf(reach) or reach >= max(near, 1e-6)


def _things(hits: list[float]) -> list[float]:
    """Return the nearest hits of the nearest few things, nearest first."""
    found: list[float] = []
    while hits and len(found) < _THINGS:
        nearest = min(hits)
        found.append(nearest)
        hits = [hit for hit in hits if hit > nearest + DEPTH]
    return found
