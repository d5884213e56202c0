"""News since the last look: new robots, and new topics and frames of robots."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from webmap.discovery.findings import ROLES, Findings, FoundRobot, Guess, TopicRole


@dataclass(frozen=True, slots=True)
class News:
    """A new robot, or one with more topics or frames than before."""

    robot: FoundRobot
    """All that is known of it: topics in use stay, new ones are added."""

    roles: tuple[TopicRole, ...] = ()
    """Its additional roles; empty for a new robot."""

    moved: bool = False
    """Whether its frames differ from those before."""


class Newcomers:
    """Reports each news once, when it is stable.

    The topics of a robot that starts appear one by one. Therefore news is reported
    only when two consecutive looks find the same topics of the robot. A topic that
    disappears, or a better topic that appears, is no news: a topic in use stays in use.
    All cameras are used, so each new one is news. Frames are news if
    :func:`leads_further` is true, and else stay as they are.

    Args:
        known: Robots that are there already.

    """

    def __init__(self, known: Iterable[FoundRobot] = ()) -> None:
        self._known = {robot.namespace: robot for robot in known}
        self._seen: dict[str, FoundRobot] = {}

    def look(self, findings: Findings) -> list[News]:
        """Process the newest findings, and return the stable news."""
        before, self._seen = self._seen, {}
        news = []
        everyone = self._known.values()
        taken = {g.topic for one in everyone for g in one.guesses.get("odometry", ())}
        for robot in findings.robots:
            known = self._known.get(robot.namespace)
            if known is None and robot.topic("odometry") in taken:
                continue  # a part of a known robot; its frames were not received again
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
    """Return a robot with its known topics and the new ones added."""
    guesses = {**robot.guesses, **known.guesses}
    if "camera" in guesses:
        guesses["camera"] = _all_cameras(robot, known)
    # A pose topic may be silent while the robot does not move; other sources are not.
    framed = known.tf_namespace is not None and known.base_frame != ""
    if "pose" not in known.guesses and (known.topic("odometry") or framed):
        guesses.pop("pose", None)
    if not leads_further(robot, known):
        robot = replace(
            robot,
            base_frame=known.base_frame,
            root_frame=known.root_frame,
            above=known.above,
        )
    return replace(robot, guesses=guesses)


def leads_further(robot: FoundRobot, known: FoundRobot) -> bool:
    """Return whether a robot's frames lead further up than the known ones.

    They do if none were known, or if the known root has become a child of the new
    root, as ``odom`` of ``map`` once a robot has localized itself. Frames that were
    not received for some time, and a root unrelated to the known one, change nothing.
    """
    if not known.root_frame:
        return robot.root_frame != ""
    above = robot.above
    if known.root_frame not in above or robot.root_frame not in above:
        return False
    return above.index(robot.root_frame) > above.index(known.root_frame)


def _more(robot: FoundRobot, known: FoundRobot) -> tuple[TopicRole, ...]:
    new = {role for role in robot.guesses if role not in known.guesses}
    if len(robot.guesses.get("camera", ())) > len(known.guesses.get("camera", ())):
        new.add("camera")
    return tuple(role for role in ROLES if role in new)


def _all_cameras(robot: FoundRobot, known: FoundRobot) -> tuple[Guess, ...]:
    """Return the known cameras, followed by the new ones."""
    before = known.guesses.get("camera", ())
    topics = {guess.topic for guess in before}
    more = robot.guesses.get("camera", ())
    return (*before, *(guess for guess in more if guess.topic not in topics))
