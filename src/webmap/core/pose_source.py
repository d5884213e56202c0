"""Receives a robot's poses from a topic and from TF.

:mod:`webmap.poses.pipeline` processes the messages; here are the subscriptions, the
clock and the alignment.
"""

import math
import time
from collections.abc import Callable, Mapping
from functools import partial

import msgspec

from webmap.base.geometry import Affine, Pose
from webmap.base.scope import Removal, no_scope
from webmap.config.robot import OdometryConfig, TfConfig
from webmap.core.frame_pace import frame_pace
from webmap.core.movable_robot import MovableRobot
from webmap.poses.alignment import HERE, alignments
from webmap.poses.frames import Frames, frames_of
from webmap.poses.odometry import ODOMETRY, OdometryFeed
from webmap.poses.pipeline import PosePipeline, Problem, Step
from webmap.poses.placing import Placing, PoseReading
from webmap.poses.silence import LIMIT, PERIODS, SilenceWatch
from webmap.ros.bridge import Bridge


class PoseSource:
    """Receives a robot's poses and puts them on the common map.

    Args:
        robot: The robot, which shows the problems of its poses.
        show_pose: Draws the robot; called with a pose on the common map, and the time
            when the pose was sent, or None if only the alignment changed.

    """

    def __init__(
        self,
        robot: MovableRobot,
        show_pose: Callable[[PoseReading, float | None], object],
    ) -> None:
        self.pipeline = PosePipeline()
        self.feed: OdometryFeed | None = None
        """The odometry topic, if there is one."""
        self.frames: Frames | None = None
        """The frames that place the poses; None to use poses without a transform."""
        self.tf: TfConfig | None = None
        """How they place the poses, with the full name of the robot's own frame."""
        self.bridge: Bridge | None = None
        """The bridge of the poses."""
        self.own_alignment: Pose | None = None
        """The robot's own alignment; None to use that of its bridge."""
        self.alignment = HERE
        """The position and rotation of the robot's own map on the common one."""
        self.common_from_own = Affine()
        """The transform from the robot's own map to the common one."""
        self.received_at: float | None = None
        """When the newest pose arrived, in seconds of :func:`time.monotonic`."""
        self.expected_at: float | None = None
        """When the newest pose arrived from a source that also sends at rest."""
        self.period = 0.0
        """The least time from that pose to the next one, in seconds."""
        self._is_needed = False
        self._waiting: tuple[PoseReading, float] | None = None
        """A pose of the topic that was not processed yet, and when it arrived."""
        self._processed_at = -math.inf
        self._robot = robot
        self._show_pose = show_pose
        self._silence = SilenceWatch(lambda: robot.name)
        self._problems: Mapping[str, Problem] = {}
        self._frames_removal = Removal(lambda: None)
        self._alignment_removal = Removal(lambda: None)
        self._listeners: dict[int, Callable[[], object]] = {}

    # Sources of poses.

    def follow(self, bridge: Bridge, odometry: OdometryConfig) -> None:
        """Receive poses from a topic; see :meth:`Robot.set_odometry_topic`."""
        self.unfollow()
        typed = partial(self._on_type, bridge, odometry.topic)
        if odometry.type is None:
            typed(None)  # otherwise the feed calls it at once
        try:
            with no_scope():
                self.feed = OdometryFeed(
                    bridge,
                    odometry.topic,
                    odometry.throttle,
                    odometry.type,
                    listener=self._on_reading,
                    typed=typed,
                    complain=self._on_complaint,
                    report=self._robot.report_error,
                )
        except BaseException:
            self._robot.motion.clear_odometry()
            raise
        self._restart()

    def unfollow(self) -> None:
        """Stop receiving poses from a topic; does nothing if there is none."""
        if self.feed is not None:
            self.feed.remove()
            self.feed = None
            self._robot.clear_problem("odometry")
            self._robot.motion.clear_odometry()
            self._restart()

    def place(self, bridge: Bridge, tf: TfConfig, base_link: str) -> None:
        """Transform poses to the frame of the map; see :meth:`Robot.set_tf`.

        Args:
            bridge: The bridge of the frames.
            tf: The frames.
            base_link: The robot's own frame, if ``tf`` has none.

        """
        self.unplace()
        frames = self.frames = frames_of(bridge, tf.namespace)
        base, space = tf.base_frame or base_link, frames.namespace
        placing = Placing(frames.buffer, space, tf.map_frame, base, quiet=tf.quiet)
        self.pipeline.placing = placing
        self.tf = msgspec.structs.replace(
            tf, map_frame=placing.map_frame, base_frame=placing.base_frame
        )
        self._robot.motion.base_frame = placing.base_frame
        self._frames_removal = frames.join(self._on_frames, self._needs_frames)
        self._restart()

    def unplace(self) -> None:
        """Stop placing poses by TF; does nothing if TF is not set."""
        self._frames_removal.remove()
        self.frames = self.tf = self.pipeline.placing = None
        self._restart()

    def keep_on(self, needed: bool) -> None:
        """Receive all poses also while nobody looks, or only some.

        Args:
            needed: Whether a program or a person needs all of them.

        """
        if needed != self._is_needed:
            self._is_needed = needed
            self._pace()

    def expect_fewer(self) -> None:
        """Expect the next pose later: from now on, nobody looks or needs all poses.

        A robot that is lost already stays lost.
        """
        feed, newest = self.feed, self.expected_at
        if feed is None or newest is None:
            return
        if time.monotonic() - newest <= max(LIMIT, PERIODS * self.period):
            self.period = max(self.period, feed.period)
            self._silence.expect(self.period)

    def _pace(self) -> None:
        if self.feed is not None:
            self.feed.keep_on(self._is_needed)
            self.expect_fewer()
        if self.frames is not None:
            self.frames.audience_changed()

    def _needs_frames(self) -> bool:
        """Return whether frames are needed while nobody looks.

        Without a topic with poses, only the frames show whether the robot is lost.
        """
        return self.feed is None or self._is_needed

    def end(self) -> None:
        """Stop receiving poses of the topic and of the frames."""
        self.unfollow()
        self.unplace()

    # Alignment of the robot's own map.

    @property
    def newest(self) -> PoseReading | None:
        """The newest pose, in the robot's own map."""
        return self.pipeline.newest

    def received_within(self, seconds: float) -> bool:
        """Return whether a pose of any age arrived in the last ``seconds``."""
        received = self.received_at
        return received is not None and time.monotonic() - received <= seconds

    def align(self, pose: Pose | None) -> None:
        """Set the robot's own alignment; None uses that of its bridge."""
        self.own_alignment = pose
        self._on_alignment()

    # Listeners.

    def join(self, listener: Callable[[], object]) -> Removal:
        """Call ``listener`` when pose, frames or alignment change, until removed.

        It is also called when somebody begins to look.
        """
        key = id(listener)
        self._listeners[key] = listener
        return Removal(lambda: self._listeners.pop(key, None))

    def draw(self) -> None:
        """Call the listeners, which draw by the pose."""
        for listener in tuple(self._listeners.values()):
            listener()

    # Received data.

    def _on_type(self, bridge: Bridge, topic: str, type: str | None) -> None:
        """Give the odometry to the gate, unless it has no velocity.

        The gate also watches the odometry while the type is unknown: a robot whose
        odometry never arrived would be driven blind.
        """
        if type in (None, ODOMETRY):
            self._robot.motion.set_odometry(bridge, topic, type)
        else:
            self._robot.motion.clear_odometry()

    def _on_complaint(self, text: str | None) -> None:
        if text is None:
            self._robot.clear_problem("odometry")
        else:
            self._robot.set_problem("odometry", text)

    def _on_reading(self, reading: PoseReading) -> None:
        """Process a pose from the topic, or keep the newest until the next frames."""
        feed = self.feed
        if feed is None:
            return
        self.received_at = now = time.monotonic()
        if feed.type == ODOMETRY:  # other poses may arrive only while the robot moves
            self.expected_at, self.period = now, feed.period
            self._silence.record(now, self.period)
        self._waiting = (reading, now)
        if self._is_needed:
            self._process()
        else:
            frame_pace.process(self._processed_at, now, self._process)

    def _process(self) -> None:
        """Process the newest pose of the topic, if one waits."""
        waiting, self._waiting = self._waiting, None
        if waiting is None or self.feed is None:
            return
        reading, self._processed_at = waiting
        step = self.pipeline.step(reading, self.frames, self._processed_at)
        self._show(step, self._processed_at - self.feed.bridge.lag)

    def _on_frames(self) -> None:
        """Process the pose of the base from TF, if there is no topic."""
        frames, now = self.frames, time.monotonic()
        if frames is None:
            return
        step = self.pipeline.step(None, frames, now)
        if step.pose is not None:
            # The pose may have waited for the next call of listeners.
            self.received_at = came = frames.received_at
            if step.pose.stamp:  # otherwise it is fixed to the map, and arrives once
                self.expected_at, self.period = came, 0.0
                self._silence.record(now, 0.0)
            self._show(step, came - frames.bridge.lag)
        else:
            self._show_problems(step)
            self.draw()

    def _on_alignment(self) -> None:
        """Move the robot, and what is drawn by its pose, to a new alignment."""
        own, pipeline = self.own_alignment, self.pipeline
        self.alignment = alignments.of(self.bridge) if own is None else own
        self.common_from_own = Affine.of_pose(self.alignment)
        pipeline.alignment = self.alignment
        if pipeline.newest is not None:
            self._show_pose(pipeline.on_map(pipeline.newest), None)
        self._robot.motion.set_alignment(self.alignment)
        self.draw()

    # Display.

    def _show(self, step: Step, stamp: float) -> None:
        assert step.pose is not None  # callers have one
        self._show_pose(step.pose, stamp)
        self.draw()
        if step.problems is self.pipeline.problems:  # else a listener ended this source
            self._show_problems(step)

    def _show_problems(self, step: Step) -> None:
        if step.look_again is not None and self.frames is not None:
            self.frames.wake(step.look_again - time.monotonic())
        if step.problems is not self._problems:
            self._change_problems(step.problems)

    def _change_problems(self, problems: Mapping[str, Problem]) -> None:
        before, self._problems = self._problems, problems
        for about in ("tf", "frames", "jumps"):
            old, new = before.get(about), problems.get(about)
            if old is not None and (new is None or new.kind != old.kind):
                self._robot.clear_problem(about)
            if new is not None and new != old:
                self._robot.set_problem(about, new.text)

    def _restart(self) -> None:
        """Discard the poses so far; the next ones are from another source."""
        self._waiting = None
        feed, frames = self.feed, self.frames
        bridge, topic, period = None, "", None
        if feed is not None:
            bridge, topic, period = feed.bridge, feed.topic, feed.period
        elif frames is not None:
            bridge, topic = frames.bridge, f"{frames.namespace}/tf"
        self.pipeline.restart(period)
        self._change_problems({})
        self._silence.restart(bridge, topic)
        self.expected_at = None
        self._pace()
        if bridge is not self.bridge:
            self._alignment_removal.remove()
            self.bridge = bridge
            if bridge is not None:
                self._alignment_removal = alignments.on_change(
                    bridge, self._on_alignment
                )
            self._on_alignment()
