"""What is new since the last look: robots, and topics and frames of robots."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from webmap.discovery.found import ROLES, Findings, FoundRobot, Guess, Role


@dataclass(frozen=True, slots=True)
class News:
    """A robot that is new, or one that has more than before."""

    robot: FoundRobot
    """All that is known of it now: what is in use stays, what is new comes besides."""

    roles: tuple[Role, ...] = ()
    """What it has more than before; empty for a robot that is new."""

    moved: bool = False
    """Whether it is known to move in other frames than before."""


class Newcomers:
    """Says once what is new, when it has settled.

    The topics of a robot that is being switched on come one by one. So news is told
    when two looks in a row say the same of the robot, and not before. A topic that
    goes, or a better one that comes, is no news: what is in use stays in use. Of
    cameras all are used, so each one more is news. Frames are news as
    :func:`leads_further` has it, and else they stay as well.

    Args:
        known: Robots that are there already.

    """

    def __init__(self, known: Iterable[FoundRobot] = ()) -> None:
        self._known = {robot.namespace: robot for robot in known}
        self._seen: dict[str, FoundRobot] = {}

    def look(self, findings: Findings) -> list[News]:
        """Take what is there now, and return what is new and settled."""
        before, self._seen = self._seen, {}
        news = []
        for robot in findings.robots:
            known = self._known.get(robot.namespace)
            whole = robot if known is None else _merged(robot, known)
            roles = () if known is None else _more(whole, known)
            moved = known is not None and leads_further(robot, known)
            if known is not None and not roles and not moved:
                continue
            if before.get(robot.namespace) != robot:
                self._seen[robot.namespace] = robot
                continue
            self._known[robot.namespace] = whole
            news.append(News(whole, roles, moved))
        return news


def _merged(robot: FoundRobot, known: FoundRobot) -> FoundRobot:
    """Return a robot with what is known of it, and with what is new besides."""
    guesses = {**robot.guesses, **known.guesses}
    if "camera" in guesses:
        guesses["camera"] = _all_cameras(robot, known)
    # A pose may be silent while the robot stands; what else tells its place is not.
    framed = known.tf_namespace is not None and known.base_frame != ""
    if "pose" not in known.guesses and (known.topic("odometry") or framed):
        guesses.pop("pose", None)
    if not leads_further(robot, known):
        robot = with_frames_of(robot, known)
    return replace(robot, guesses=guesses)


def leads_further(robot: FoundRobot, known: FoundRobot) -> bool:
    """Tell whether the frames of a robot lead further up than those known of it.

    They do if none were known, or if what was their root hangs from the new one, as
    ``odom`` hangs from ``map`` once a robot knows where it is. What was not heard for
    a while, and a root beside the known one, change nothing.
    """
    if not known.root_frame:
        return robot.root_frame != ""
    above = robot.above
    if known.root_frame not in above or robot.root_frame not in above:
        return False
    return above.index(robot.root_frame) > above.index(known.root_frame)


def with_frames_of(robot: FoundRobot, known: FoundRobot) -> FoundRobot:
    """Return a robot with the frames that are known of it."""
    return replace(
        robot,
        base_frame=known.base_frame,
        root_frame=known.root_frame,
        above=known.above,
    )


def _more(robot: FoundRobot, known: FoundRobot) -> tuple[Role, ...]:
    new = {role for role in robot.guesses if role not in known.guesses}
    if len(robot.guesses.get("camera", ())) > len(known.guesses.get("camera", ())):
        new.add("camera")
    return tuple(role for role in ROLES if role in new)


def _all_cameras(robot: FoundRobot, known: FoundRobot) -> tuple[Guess, ...]:
    """Return the cameras that are known, and then those that are new."""
    before = known.guesses.get("camera", ())
    topics = {guess.topic for guess in before}
    more = robot.guesses.get("camera", ())
    return (*before, *(guess for guess in more if guess.topic not in topics))
