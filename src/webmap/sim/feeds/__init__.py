"""Topics of simulated robots besides odometry and scans.

Costmaps, clouds, footprints, particles, covariances, look-ahead points, sonars, fixes,
markers, diagnostics and logs, under the names of Nav2 and move_base. Each is advertised
for each robot, and computed only while it has subscribers. A topic is a ``Feed`` of
``webmap.sim.messages``.
"""

from webmap.sim.feeds.localization import Localizations, Satellites
from webmap.sim.feeds.navigation import CostmapTopics, Footprints, Lookaheads
from webmap.sim.feeds.reports import Health, Logs, MarkerFeed
from webmap.sim.feeds.sensors import Clouds, DepthClouds, Sonars
from webmap.sim.messages import Feed, GraphNode


class Feeds:
    """The topics of a node's robots besides odometry and scans.

    Args:
        node: The node of the robots.
        step: Seconds of a step of the world.

    """

    def __init__(self, node: GraphNode, step: float) -> None:
        self._node = node
        self._step = step
        self.localizations = Localizations(node)
        self._costmaps = CostmapTopics(node)
        self._health = Health(node)
        self._logs = Logs(node)
        self._feeds: tuple[Feed, ...] = (
            *self.localizations.feeds,
            Clouds(node).feed,
            Footprints(node).feed,
            Lookaheads(node).feed,
            Sonars(node).feed,
            Satellites(node).feed,
            MarkerFeed(node).feed,
            *([DepthClouds(node).feed] if node.tilted else ()),
        )

    def start(self) -> None:
        """Advertise and subscribe to all topics."""
        for robot in self._node.world.robots:
            for feed in self._feeds:
                self._node.advertise(f"{robot.topics}/{feed.topic}", feed.type)
        self.localizations.start()
        self._costmaps.start()
        self._health.start()
        self._logs.start()

    def publish(self, steps: int) -> None:
        """Publish the messages that are due and have subscribers.

        Args:
            steps: Number of steps of the world so far.

        """
        graph, dialect = self._node.graph, self._node.messages.dialect
        for feed in self._feeds:
            if not self._is_due(steps, feed.period):
                continue
            for index, robot in enumerate(self._node.world.robots):
                topic = f"{robot.topics}/{feed.topic}"
                if graph.is_wanted(topic):
                    message = feed.make(index)
                    if message is not None and feed.frame:
                        prefix = "" if feed.frame == "map" else robot.frames
                        frame = f"{prefix}{feed.frame}"
                        header = dialect.header(topic, graph.clock(), frame)
                        message = {"header": header, **message}
                    if message is not None:
                        self._node.publish(topic, message)
        if self._is_due(steps, 0.2):
            self._costmaps.publish()
            self._logs.publish()
        if self._is_due(steps, 1.0):
            self._health.publish()

    def _is_due(self, steps: int, period: float) -> bool:
        return steps % round(period / self._step) == 0
