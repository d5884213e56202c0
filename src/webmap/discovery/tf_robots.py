"""Robots in the trees of frames; rules without I/O."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

Parents = Mapping[str, str]
"""Parent of each frame."""

BASE = re.compile(
    r"(?P<prefix>(?:.*[/_])?)(?:base_footprint|base_link)\Z|(?P<space>(?:.*/)?)base\Z"
)
"""Names of the frame of a robot's base, after a prefix of the robot."""

WORLD = re.compile(r"(?:.*[/_])?(?:map|world|earth)\Z")
MAP = "map"
"""The frame of the map, unless the tree has none of that name (REP 105)."""

ODOM = re.compile(r"(?:.*[/_])?odom(?:_[^/]*|etry)?\Z")

MOST = 200
"""Most robots that are found in the frames of one bridge."""

MOST_FRAMES = 4096
"""Most frames of one namespace that are kept; beyond it the oldest are dropped."""

_AT_ONCE = 512


@dataclass(frozen=True, slots=True)
class Base:
    """The base of one robot in a tree of frames."""

    frame: str
    root: str
    """The frame that it can be drawn in: the map, or the start of its odometry."""

    namespace: str = ""
    """Namespace of the topic with its frames."""

    above: tuple[str, ...] = ()
    """Its parent frames, the nearest first."""

    @property
    def prefix(self) -> str:
        """The prefix of the base's name, without the separator."""
        found = BASE.match(self.frame)
        return (found["prefix"] or found["space"] or "").rstrip("/_") if found else ""

    @property
    def space(self) -> str:
        """The likely namespace of its other topics."""
        name = re.sub(r"[^A-Za-z0-9_/]", "_", self.prefix)
        if not name or self.namespace.endswith(f"/{name}"):
            return self.namespace
        return f"{self.namespace}/{name}"


@dataclass(slots=True)
class Trees:
    """The received frames, by the namespace of their topic."""

    parents: dict[str, dict[str, str]] = field(default_factory=dict)
    """Parents of frames, by namespace; the frame received longest ago is first."""

    odometry: dict[str, str] = field(default_factory=dict)
    """The ``child_frame_id`` of odometry, by topic."""

    def take(self, namespace: str, parent: str, child: str) -> None:
        """Store the parent of a frame.

        A detector may publish a new frame for each object, so the number is limited:
        see :data:`MOST_FRAMES`. Bases and their parents are kept longest.
        """
        parent, child = parent.strip().strip("/"), child.strip().strip("/")
        if parent and child:
            known = self.parents.setdefault(namespace, {})
            known.pop(child, None)
            if len(known) >= MOST_FRAMES:
                _forget_some(known)
            known[child] = parent

    def copy(self) -> "Trees":
        """Return a copy, which later frames do not change."""
        parents = {space: dict(known) for space, known in self.parents.items()}
        return Trees(parents, dict(self.odometry))

    def base_of(self, frame: str, namespace: str) -> Base:
        """Return the base above a frame, or the frame itself; its root is not set."""
        chain = [frame, *_above(frame, self.parents.get(namespace, {}))]
        return Base(next(filter(BASE.match, chain[::-1]), frame), "", namespace)

    def bases(self) -> tuple[Base, ...]:
        """Return the robots in the trees, sorted by namespace and frame."""
        found = [
            base
            for namespace, parents in self.parents.items()
            for base in bases(parents, namespace)
        ]
        return tuple(sorted(found, key=lambda base: (base.space, base.frame))[:MOST])


def bases(parents: Parents, namespace: str = "") -> Iterable[Base]:
    """Return the bases of robots that move in a map or from where they started.

    A base below another base is a part of that robot, such as an arm's.
    """
    for frame in parents:
        if BASE.match(frame) is None:
            continue
        chain = _above(frame, parents)
        if any(BASE.match(other) for other in chain):
            continue
        worlds = [other for other in chain if WORLD.match(other)]
        odometry = [other for other in chain if ODOM.match(other)]
        if worlds or odometry:
            root = MAP if MAP in worlds else (worlds or odometry)[-1]
            yield Base(frame, root, namespace, tuple(chain))


def _forget_some(known: dict[str, str]) -> None:
    """Drop the oldest frames; many at once, because this function visits all."""
    kept: set[str] = set()
    for frame in known:
        if BASE.match(frame):
            kept.update((frame, *_above(frame, known)))
    others = [frame for frame in known if frame not in kept]
    if len(others) < _AT_ONCE:
        others = list(known)  # That many bases are not robots.
    for frame in others[:_AT_ONCE]:
        del known[frame]


def _above(frame: str, parents: Parents) -> list[str]:
    """Return the parents of a frame, up to the root or the start of a loop."""
    chain = [frame]
    while chain[-1] in parents and parents[chain[-1]] not in chain:
        chain.append(parents[chain[-1]])
    return chain[1:]


def owners(
    found: Iterable[Base], spaces: Iterable[str]
) -> tuple[dict[str, Base], list[Base]]:
    """Return the bases of known robots by namespace, and the bases of new robots.

    A single base belongs to a single robot if both have no namespace: the frames of
    one robot often have a prefix while its topics have none.

    Args:
        found: The bases.
        spaces: The namespaces that are robots by their topics.

    """
    known, new = tuple(spaces), []
    mine: dict[str, Base] = {}
    for base in found:
        space = _owner(base, known)
        if space is None:
            new.append(base)
        elif space not in mine:
            mine[space] = base
    if known == ("",) and not mine and len(new) == 1 and not new[0].namespace:
        mine[""] = new.pop()
    if len(known) > 1 and "" not in known:
        # Frames without a prefix may belong to any of the robots.
        new = [base for base in new if base.space]
    return mine, new


def _owner(base: Base, spaces: tuple[str, ...]) -> str | None:
    if base.space in spaces:
        return base.space
    if not base.space and len(spaces) == 1:
        return spaces[0]
    last = base.space.rpartition("/")[2].casefold()
    alike = [s for s in spaces if last and s.rpartition("/")[2].casefold() == last]
    return alike[0] if len(alike) == 1 else None
