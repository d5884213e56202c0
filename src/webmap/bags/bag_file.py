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
"""The version of the metadata of a ROS 2 bag: Humble and later releases read it."""

FOREVER = (9223372036, 854775807)
"""An infinite duration in ROS 2, in seconds and nanoseconds."""


class BagFile(Protocol):
    """A bag that is written message by message."""

    path: Path

    def add(self, topic: str, version: TypeVersion) -> Any:
        """Add a topic, and return the channel for its messages."""

    def write(self, channel: Any, time: int, data: bytes) -> None:
        """Write a message, with its time of arrival in nanoseconds since 1970."""

    def close(self) -> None:
        """Complete and close the file, so that other programs can open it."""


def new_bag(path: Path, dialect: DialectName) -> BagFile:
    """Create a bag; nothing that exists is overwritten.

    Args:
        path: A file for ROS 1 (``.bag`` is added if missing), a folder for ROS 2.
        dialect: ROS 1 or ROS 2.

    Raises:
        ConfigError: If the path exists, does not fit the dialect, or rosbags cannot
            make a bag of it.
        OSError: If the bag cannot be written there.

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
        raise ConfigError(f"{path} cannot be created: {error}") from None


class Ros1Bag:
    """A ``.bag`` file."""

    def __init__(self, path: Path) -> None:
        from rosbags.rosbag1 import Writer

        self.path = path
        self._writer = Writer(path)
        self._writer.open()

    def add(self, topic: str, version: TypeVersion) -> Any:
        """Add a topic, and return the channel for its messages."""
        return self._writer.add_connection(
            topic,
            version.type_name,
            typestore=version.store,
            callerid="/webmap",
            latching=int(is_latched(topic, canonical(version.type_name))),
        )

    def write(self, channel: Any, time: int, data: bytes) -> None:
        """Write a message, with its time of arrival in nanoseconds since 1970."""
        self._writer.write(channel, time, data)

    def close(self) -> None:
        """Complete and close the file, so that other programs can open it."""
        self._writer.close()


class Ros2Bag:
    """A folder with an MCAP file and its description.

    MCAP holds the definitions of the types, and most of an unclosed file can be
    recovered. rosbags writes sqlite3 as one transaction, of which nothing would remain.
    """

    def __init__(self, path: Path) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer

        self.path = path
        self._writer = Writer(
            path, version=METADATA_VERSION, storage_plugin=StoragePlugin.MCAP
        )
        self._writer.open()

    def add(self, topic: str, version: TypeVersion) -> Any:
        """Add a topic, and return the channel for its messages."""
        latched = is_latched(topic, canonical(version.type_name))
        return self._writer.add_connection(
            topic,
            version.type_name,
            typestore=version.store,
            offered_qos_profiles=[_kept()] if latched else [],
        )

    def write(self, channel: Any, time: int, data: bytes) -> None:
        """Write a message, with its time of arrival in nanoseconds since 1970."""
        self._writer.write(channel, time, data)

    def close(self) -> None:
        """Complete and close the file, so that other programs can open it."""
        self._writer.close()


def _kept() -> "Qos":
    """Return the quality of service of a publisher that latches its newest message."""
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
