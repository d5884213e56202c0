"""A recording on disk: its topics, and its messages in order."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from webmap.bags.files import (
    add_defaults,
    dialect_of,
    is_json,
    is_latched_in_file,
    mcap_files,
    opened,
    reason,
    recording_name,
    unreadable,
    why_unreadable,
)
from webmap.bags.times import SECOND
from webmap.bags.types import bytes_of_json, texts_of
from webmap.base.errors import ConfigError
from webmap.ros.definitions import Definitions, UnknownType
from webmap.ros.rosbridge.server.dialect import Dialect, canonical, resolve
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.serialized.reader import Reader, make_reader
from webmap.ros.serialized.schemas import Schema as MessageSchema

if TYPE_CHECKING:
    from rosbags.interfaces import Connection


NAMES = ("map", "tf_static", "robot_description")
"""Names of topics that latch, even if the bag does not mark them so."""

TYPES = ("nav_msgs/OccupancyGrid",)
"""Types whose newest message is kept on any topic: large and rare."""

STATIC = "tf_static"


def is_latched(topic: str, type_name: str) -> bool:
    """Return whether the newest message of a topic is kept by its name or type.

    Args:
        topic: The name of the topic.
        type_name: Canonical, such as ``nav_msgs/OccupancyGrid``.

    """
    return topic.rpartition("/")[2] in NAMES or type_name in TYPES


def is_static(topic: str) -> bool:
    """Return whether a topic carries static transforms."""
    return topic.rpartition("/")[2] == STATIC


class AllFrames:
    """The newest transform of each frame so far, as one message.

    Each node publishes its own transforms, and a bag does not record the node of a
    message. So the newest message alone would lack the transforms of other nodes.
    """

    def __init__(self) -> None:
        self._frames: dict[str, Any] = {}

    def with_all(self, message: dict[str, Any]) -> dict[str, Any]:
        """Return a ``tf2_msgs/TFMessage`` that includes all earlier transforms."""
        for transform in message["transforms"]:
            self._frames[transform["child_frame_id"]] = transform
        return {"transforms": list(self._frames.values())}


RECENT = 2 * SECOND
"""How far the state at a time looks back at first, in nanoseconds."""

LONGEST_LOOK = 60 * SECOND
"""How far it looks back for a topic that does not latch, in nanoseconds."""

LOGS = ("rosgraph_msgs/Log", "rcl_interfaces/Log")
"""Types of log lines, which are events and no state."""

FRAMES = "tf2_msgs/TFMessage"


class Recorded(NamedTuple):
    """A recorded message, not decoded yet."""

    topic: str
    time: int
    """Its time of arrival, in nanoseconds since 1970."""

    connection: "Connection"
    data: bytes


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """A topic of a recording with its one type."""

    name: str
    type: str
    """Canonical: ``nav_msgs/Odometry``."""

    latched: bool
    """Whether later subscribers also get its newest message."""


class Recording:
    """A bag of ROS 1, several that are played as one, or a bag of ROS 2.

    Messages are read on demand, so memory does not grow with the file; of a bag of ROS
    1 the index is kept in memory.

    Args:
        paths: Files (``.bag``, ``.mcap``, ``.db3``), or the folder of a bag of ROS 2.
        warn: Called with a sentence about each part that is left out.
        undecoded: Whether :meth:`messages` and :meth:`state_at` include the topics that
            cannot be decoded.

    Raises:
        ConfigError: If there is no such file, or it cannot be read.

    """

    def __init__(
        self,
        paths: Sequence[Path],
        *,
        warn: Callable[[str], object] = lambda _: None,
        undecoded: bool = False,
    ) -> None:
        self.paths = tuple(paths)
        """Its files or its folder."""
        self.name = recording_name(paths)
        """The name, as shown to people."""
        self._warn = warn
        self._failed: set[str] = set()
        self._readers: dict[str, Reader] = {}
        self._closed = False
        self._reader, self.dialect = opened(paths, dialect_of(paths))
        try:
            self._warn_of_cut_files()
            self.begin = self._reader.start_time
            """Time of the first message, in nanoseconds since 1970."""
            self.end = self._reader.end_time
            """Time right after the last message, in nanoseconds since 1970."""
            self.schema = Schema(Dialect(self.dialect))
            self.topics: dict[str, RecordedTopic] = {}
            self._names: dict[str, str] = {}
            self._connections = self._usable()
            self.connections = self._all_named() if undecoded else self._connections
            """The topics in the files with messages in :meth:`messages`, as rosbags
            describes them."""
        except ConfigError:
            self.close()
            raise
        except Exception as error:
            self.close()
            raise unreadable(self.paths, error) from None

    @property
    def seconds(self) -> float:
        """The time from the first to the last message, in seconds."""
        return (self.end - self.begin) / SECOND

    def close(self) -> None:
        """Close the files; a second call does nothing."""
        if not self._closed:
            self._closed = True
            self._reader.close()

    def messages(self, start: int) -> Iterator[Recorded]:
        """Yield the messages from a time on, in order.

        Args:
            start: The time, in nanoseconds since 1970.

        Raises:
            ConfigError: If the file is damaged there.

        """
        return self._read(self.connections, start, None)

    def _topic(self, name: str) -> RecordedTopic:
        return self.topics.get(name) or RecordedTopic(name, "", False)

    def definition(self, connection: "Connection") -> str:
        """Return the definition of a topic's type and its parts; empty if unknown."""
        if connection.msgdef.data:
            return connection.msgdef.data
        release: Literal[1, 2] = 1 if self.dialect == "ros1" else 2
        try:
            return self._reader.typestore.generate_msgdef(
                connection.msgtype, ros_version=release
            )[0]
        except Exception:
            return ""

    def messages_of(self, wants: Callable[[str, str], bool]) -> Iterator[Recorded]:
        """Yield all messages of some topics, in order.

        Args:
            wants: Called with the name and the type of a topic.

        Raises:
            ConfigError: If the file is damaged.

        """
        wanted = [
            connection
            for connection in self._connections
            if wants(name := self._names[connection.topic], self.topics[name].type)
        ]
        yield from self._read(wanted, None, None) if wanted else ()

    def state_at(
        self, time: int, go_on: Callable[[], bool] = lambda: True
    ) -> list[Recorded]:
        """Return the messages up to a time that show the state then, in order.

        They are all static frames, the frames of the last two seconds, and the newest
        message of every other topic, also of latched topics from long before. Log lines
        are no state.

        Args:
            time: The time, in nanoseconds since 1970; its own messages are included.
            go_on: Called repeatedly; returns whether to continue. If not, the result is
                not complete.

        Raises:
            ConfigError: If the file is damaged before that time.

        """
        static = [c for c in self.connections if is_static(self._names[c.topic])]
        found: list[Recorded] = []
        for recorded in self._read(static, None, time + 1) if static else ():
            if not go_on():
                return found
            found.append(recorded)
        rest = [
            connection
            for connection in self.connections
            if connection not in static
            and self._topic(self._names[connection.topic]).type not in LOGS
        ]
        end, span, newest = time + 1, RECENT, dict[str, Recorded]()
        # Each further look back is longer, and only for topics without a message yet.
        while rest and end > self.begin and go_on():
            begin = max(end - span, self.begin)
            latest: dict[str, Recorded] = {}
            for recorded in self._read(rest, begin, end):
                if not go_on():
                    return found
                latest[recorded.topic] = recorded
                if self._topic(recorded.topic).type == FRAMES:
                    found.append(recorded)
            newest |= latest
            end, span = begin, span * 4
            rest = [
                connection
                for connection in rest
                if (name := self._names[connection.topic]) not in newest
                and (self._topic(name).latched or time - end < LONGEST_LOOK)
            ]
        found += [
            one for one in newest.values() if self._topic(one.topic).type != FRAMES
        ]
        return sorted(found, key=lambda one: one.time)

    def message(self, recorded: Recorded) -> dict[str, Any] | None:
        """Return a message for the rosbridge server to publish.

        None if its bytes do not fit its type, which is reported once for each topic.
        """
        try:
            type_name, data = self.topics[recorded.topic].type, recorded.data
            if is_json(recorded.connection):
                fields = self.schema.fields(type_name)
                data = bytes_of_json(fields, data, ros2=self.dialect == "ros2")
            message: dict[str, Any] = self._reads(type_name)(data)
            return message
        except Exception as error:
            if recorded.topic not in self._failed:
                self._failed.add(recorded.topic)
                self._warn(
                    f"{self.name}: messages of {recorded.topic} that are not of the "
                    f"type {recorded.connection.msgtype} are not played "
                    f"({reason(error)})"
                )
            return None

    def _reads(self, type_name: str) -> Reader:
        """Return the function that reads the messages of a type."""
        if type_name not in self._readers:
            ros2 = self.dialect == "ros2"
            schema = MessageSchema(type_name, self.schema.fields(type_name), ros2)
            reader = make_reader(schema, None, "cdr" if ros2 else "ros1")
            self._readers[type_name] = reader
        return self._readers[type_name]

    def _read(
        self, connections: "Sequence[Connection]", start: int | None, stop: int | None
    ) -> Iterator[Recorded]:
        try:
            for connection, time, data in self._reader.messages(
                connections, start, stop
            ):
                name = self._names[connection.topic]
                yield Recorded(name, time, connection, data)
        except Exception as error:
            raise unreadable(self.paths, error) from None

    def _usable(self) -> "list[Connection]":
        """Return the connections that can be played; register topics and types."""
        if self._reader.message_count == 0:
            raise ConfigError(f"{self.name}: it contains no message")
        add_defaults(self._reader, self.dialect)
        usable = []
        for connection in self._reader.connections:
            if why := why_unreadable(connection):
                self._leave_out(connection, why)
                continue
            try:
                texts = texts_of(self._reader.typestore, connection.msgtype)
                type_name = canonical(connection.msgtype)
                Definitions(texts, ros2=self.dialect == "ros2").definition(type_name)
            except ConfigError as error:
                unknown = error.type if isinstance(error, UnknownType) else None
                why = f"there is no definition of {unknown}" if unknown else str(error)
                self._leave_out(connection, why)
                continue
            name = self._names[connection.topic] = resolve(connection.topic)
            known = self.topics.get(name)
            if known is not None and known.type != type_name:
                self._leave_out(connection, f"it is a {known.type} too")
                continue
            self.schema.define(texts)
            latched = (known is not None and known.latched) or is_latched_in_file(
                connection
            )
            latched = latched or is_latched(name, type_name)
            self.topics[name] = RecordedTopic(name, type_name, latched)
            usable.append(connection)
        if not usable:
            raise ConfigError(f"{self.name}: none of its topics can be played")
        return usable

    def _all_named(self) -> "list[Connection]":
        """Return all connections but further types of a topic that is played."""
        rest = [
            connection
            for connection in self._reader.connections
            if connection not in self._connections
            and self._names.setdefault(connection.topic, connection.topic)
            not in self.topics
        ]
        return self._connections + rest

    def _warn_of_cut_files(self) -> None:
        """Report each file that ends too early; it is played up to there."""
        for file in mcap_files(self._reader):
            if file.cut:
                self._warn(
                    f"{self.name} is played only up to where it can be read: "
                    f"{file.cut}; `mcap recover` makes a complete file of that part"
                )

    def _leave_out(self, connection: "Connection", why: str) -> None:
        self._warn(
            f"{self.name}: {connection.topic} ({connection.msgtype}) is left out: {why}"
        )
