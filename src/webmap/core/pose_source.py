"""Where the poses of a robot come from: a topic, the frames, or one by the other."""

import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from webmap.core.frames import Frames, frames_of
from webmap.core.motion import MotionRoad
from webmap.core.odometry import OdometryFeed, PoseReading
from webmap.core.placing import Placing
from webmap.core.pose_troubles import PoseTroubles
from webmap.core.refusals import Owner
from webmap.core.silence import SilenceWatch
from webmap.core.whereabouts import Whereabouts
from webmap.geometry import Pose
from webmap.ros.bridge import Bridge
from webmap.scope import Removal, Scope, no_scope

ODOMETRY = "nav_msgs/Odometry"
"""The type of poses that tells velocity too."""


class PoseOwner(Owner, Protocol):
    """Who is told what is wrong with its poses: a robot."""

    name: str

    def report_error(self, text: str) -> None:
        """Show people what failed and is over."""


class PoseSource:
    """Takes a robot's poses from where they come to the common map.

    Args:
        owner: The robot, which is told what is wrong with its poses.
        motion: Its road to the gate, which looks at the odometry for itself.
        heard: Called whenever a pose came in, and before it is shown.
        show: Called with each pose, on the common map.

    """

    def __init__(
        self,
        owner: PoseOwner,
        motion: MotionRoad,
        heard: Callable[[], object],
        show: Callable[[PoseReading], object],
    ) -> None:
        self.whereabouts = Whereabouts()
        self.stamp: float | None = None
        """When the newest was sent, in seconds of :func:`time.monotonic`."""
        self.heard_at: float | None = None
        """When the newest came in, by the same clock."""
        self.expected_at: float | None = None
        """When the newest pose came that would also come from a robot at rest."""
        self.feed: OdometryFeed | None = None
        """The topic, if there is one."""
        self._owner = owner
        self._motion = motion
        self._heard = heard
        self._show = show
        self._frames: Frames | None = None
        self._placing: Placing | None = None
        self._quiet = False
        self._hears_frames = Removal(lambda: None)
        self._troubles = PoseTroubles(owner)
        self._silence = SilenceWatch(owner)

    def follow(
        self, bridge: Bridge, topic: str, throttle: int, type: str | None
    ) -> None:
        """Take poses from a topic; see :meth:`Robot.set_odometry_topic`."""
        self.unfollow()
        say = self._on_feed_problem

        def typed(type: str | None) -> None:
            # From the first word on: who drives a robot by odometry that never came
            # drives blind. Poses without a velocity show no motion in any case.
            if type in (None, ODOMETRY):
                self._motion.set_odometry(bridge, topic, type)
            else:
                self._motion.clear_odometry()

        if type is None:
            typed(None)  # else the feed says it at once
        scope = Scope(f"poses of {topic}", self._failed, lambda _: say(None))
        try:
            with no_scope():
                self.feed = OdometryFeed(
                    bridge, topic, throttle, type, self._on_pose, say, typed, scope
                )
        except BaseException:
            self._motion.clear_odometry()
            raise
        self._find_bridge()

    def unfollow(self) -> None:
        """Take poses from no topic; does nothing if it is so."""
        if self.feed is not None:
            self.feed.remove()
            self.feed = None
            self._owner.clear_problem("odometry")
            self._motion.clear_odometry()
            self._find_bridge()

    def place(
        self,
        bridge: Bridge,
        map_frame: str,
        base_frame: str,
        namespace: str,
        quiet: bool,
    ) -> None:
        """Take poses to the frame of the map; see :meth:`Robot.set_tf`."""
        self.unplace()
        frames = frames_of(bridge, namespace)
        self._frames = frames
        self._placing = Placing(frames.buffer, map_frame, base_frame, frames.namespace)
        self._motion.base_frame = self._placing.base_frame
        self._quiet = quiet
        self._hears_frames = frames.join(self._on_frames)
        self._find_bridge()

    def unplace(self) -> None:
        """Take poses as they come; does nothing if it is so."""
        self._hears_frames.remove()
        self._frames = self._placing = None
        self._find_bridge()

    @property
    def tf(self) -> Mapping[str, Any] | None:
        """The arguments of :meth:`Robot.set_tf`, None if it is not set."""
        if self._frames is None or self._placing is None:
            return None
        return {
            "bridge": self._frames.bridge,
            "map_frame": self._placing.map_frame,
            "base_frame": self._placing.base_frame,
            "namespace": self._frames.namespace,
            "quiet": self._quiet,
        }

    def align(self, pose: Pose | None) -> None:
        """Lay the robot's own map somewhere; with None it goes with its bridge."""
        self.whereabouts.align(pose)
        self._on_alignment()

    def end(self) -> None:
        """Hear of no pose any more."""
        self.unfollow()
        self.unplace()

    def _on_pose(self, reading: PoseReading) -> None:
        feed = self.feed
        now = self._hear(0.0 if feed is None else feed.bridge.lag)
        if feed is not None and feed.type == ODOMETRY:
            # Other poses may come only while the robot moves.
            self.expected_at = now
            self._silence.hear(feed.bridge, feed.topic, feed.throttle / 1000)
        if self._placing is not None:
            reading = self._placing.of_reading(reading, now)
        self._take(reading)
        self._tell_trouble()

    def _on_frames(self) -> None:
        """Look where the frames have the base, if no topic says where it is."""
        placing, frames = self._placing, self._frames
        if self.feed is None and placing and frames:
            reading = placing.of_base(time.monotonic())
            if reading is not None:
                # It may have waited to be told with others.
                now = self._hear(frames.bridge.lag, frames.heard_at)
                if reading.stamp:  # else it is fixed to the map, and told once
                    self.expected_at = now
                    self._silence.hear(frames.bridge, f"{frames.namespace}/tf")
                self._take(reading)
        self._tell_trouble()
        self.whereabouts.tell()

    def _on_alignment(self) -> None:
        """Go where a new alignment has the robot, and all that it knows."""
        if self.whereabouts.newest is not None:
            self._show(self.whereabouts.on_map(self.whereabouts.newest))
        self._motion.set_alignment(self.whereabouts.alignment)
        self.whereabouts.tell()

    def _on_feed_problem(self, text: str | None) -> None:
        if text is None:
            self._owner.clear_problem("odometry")
        else:
            self._owner.set_problem("odometry", text)

    def _failed(self, text: str, about: object) -> None:
        if about is None:
            self._owner.report_error(text)
        else:
            self._on_feed_problem(text)

    def _find_bridge(self) -> None:
        """Note where poses come from now: the alignment of that bridge holds."""
        self.whereabouts.forget()
        self._troubles.forget()
        self._silence.forget()
        self.expected_at = None
        source = self._frames if self.feed is None else self.feed
        bridge = None if source is None else source.bridge
        if bridge is not self.whereabouts.bridge:
            self.whereabouts.come_from(bridge, self._on_alignment)
            self._on_alignment()

    def _tell_trouble(self) -> None:
        """Say what is wrong with the frames or the poses; take back what is mended."""
        self._troubles.look(
            self._placing, self._frames, self.whereabouts.jumps, quiet=self._quiet
        )

    def _hear(self, lag: float, came: float | None = None) -> float:
        """Note that a pose came, and return when; that is now if it is not said."""
        self.heard_at = came = time.monotonic() if came is None else came
        self.stamp = came - lag
        self._heard()
        return came

    def _take(self, reading: PoseReading) -> None:
        """Take the newest pose, in the robot's own map."""
        period = 0.0 if self.feed is None else self.feed.throttle / 1000
        # Of poses by frames alone the frames say it themselves when time leaps.
        timed = self.feed is not None
        self.whereabouts.jumps.look(reading, time.monotonic(), timed=timed)
        self._show(self.whereabouts.take(reading, period))
        self.whereabouts.tell()
