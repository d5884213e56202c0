"""Which robots are new since the last look."""

from collections.abc import Iterable

from webmap.discovery.found import Findings, FoundRobot


class Newcomers:
    """Says of each robot once that it is new, when it has settled.

    The topics of a robot that is being switched on come one by one. So a robot is
    told when two looks in a row say the same of it, and not before.

    Args:
        known: Namespaces of robots that are there already.

    """

    def __init__(self, known: Iterable[str] = ()) -> None:
        self._known = set(known)
        self._seen: dict[str, FoundRobot] = {}

    def look(self, findings: Findings) -> list[FoundRobot]:
        """Take what is there now, and return the robots that are new and settled."""
        before, self._seen = self._seen, {}
        settled = []
        for robot in findings.robots:
            if robot.namespace in self._known:
                continue
            if before.get(robot.namespace) == robot:
                self._known.add(robot.namespace)
                settled.append(robot)
            else:
                self._seen[robot.namespace] = robot
        return settled
