"""The file of a recording that is being made."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from webmap.bags.recording import is_latched
from webmap.bags.types import TypeVersion
from webmap.base.errors import ConfigError
from webmap.ros.rosbridge.server.dialect import DialectName, canonical

if TYPE_CHECKING:
    from rosbags.interfaces import Qos

METADATA_VERSION: Literal[8] = 8
"""What a bag of ROS 2 calls its form: Humble and all later releases read this one."""

FOREVER = (9223372036, 854775807)
"""What ROS 2 says for a time without an end, in seconds and nanoseconds."""


class BagFile(Protocol):
    """A bag that is written message by message."""

    path: Path

    def add(self, topic: str, version: TypeVersion) -> Any:
        """Begin a topic, and return what its messages are written to."""

    def write(self, channel: Any, time: int, data: bytes) -> None:
        """Write a message that came at a time, in nanoseconds since 1970."""

    def close(self) -> None:
        """End the file, so that others can open it."""


def new_bag(path: Path, dialect: DialectName) -> BagFile:
    """Begin a bag; nothing that exists is overwritten.

    Args:
        path: A file for ROS 1, to which ``.bag`` is added if need be, and a folder for
            ROS 2.
        dialect: Which ROS.

    Raises:
        ConfigError: If something of that name exists, it does not suit the dialect, or
            rosbags makes no bag of it.
        OSError: If it cannot be written there.

    """
    if dialect == "ros1" and path.suffix != ".bag":
        path = path.with_name(f"{path.name}.bag")
    if dialect == "ros2" and path.suffix in (".bag", ".mcap", ".db3"):
        raise ConfigError(
            f"{path}: a bag of ROS 2 is a folder; give it a name without {path.suffix}"
        )
    if path.exists():
        raise ConfigError(f"{path} exists already, and nothing is overwritten")
    from rosbags.rosbag1 import WriterError as Ros1Error
    from rosbags.rosbag2 import WriterError as Ros2Error

    try:
        return Ros1Bag(path) if dialect == "ros1" else Ros2Bag(path)
    except (Ros1Error, Ros2Error) as error:
        raise ConfigError(f"{path} cannot be made: {error}") from None


class Ros1Bag:
    """A ``.bag`` file."""

    def __init__(self, path: Path) -> None:
        from rosbags.rosbag1 import Writer

        self.path = path
        self._writer = Writer(path)
        self._writer.open()

    def add(self, topic: str, version: TypeVersion) -> Any:
        """Begin a topic, and return what its messages are written to."""
        return self._writer.add_connection(
            topic,
            version.type_name,
            typestore=version.store,
            callerid="/webmap",
            latching=int(is_latched(topic, canonical(version.type_name))),
        )

    def write(self, channel: Any, time: int, data: bytes) -> None:
        """Write a message that came at a time, in nanoseconds since 1970."""
        self._writer.write(channel, time, data)

    def close(self) -> None:
        """End the file, so that others can open it."""
        self._writer.close()


class Ros2Bag:
    """A folder with an MCAP file and its description.

    MCAP holds the definitions of the types, and most of it can be recovered when it was
    not closed; rosbags writes sqlite3 as one transaction, of which nothing would be
    left.
    """

    def __init__(self, path: Path) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer

        self.path = path
        self._writer = Writer(
            path, version=METADATA_VERSION, storage_plugin=StoragePlugin.MCAP
        )
        self._writer.open()

    def add(self, topic: str, version: TypeVersion) -> Any:
        """Begin a topic, and return what its messages are written to."""
        latched = is_latched(topic, canonical(version.type_name))
        return self._writer.add_connection(
            topic,
            version.type_name,
            typestore=version.store,
            offered_qos_profiles=[_kept()] if latched else [],
        )

    def write(self, channel: Any, time: int, data: bytes) -> None:
        """Write a message that came at a time, in nanoseconds since 1970."""
        self._writer.write(channel, time, data)

    def close(self) -> None:
        """End the file, so that others can open it."""
        self._writer.close()


def _kept() -> "Qos":
    """Return what a publisher offers whose newest message is for latecomers too."""
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    forever = QosTime(*FOREVER)
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=1,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL,
        deadline=forever,
        lifespan=forever,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=forever,
        avoid_ros_namespace_conventions=False,
    )
