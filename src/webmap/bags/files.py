"""The files of a recording: how they are opened, and why they cannot be read."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from webmap.base.errors import ConfigError
from webmap.base.plain_files import refuse_special, resolved
from webmap.ros.rosbridge.server.dialect import DialectName

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import Connection
    from rosbags.typesys.store import Typestore

    from webmap.bags.mcap_file import McapFile

ROS1, ROS2 = ".bag", (".mcap", ".db3")

METADATA = "metadata.yaml"

LARGEST_METADATA = 4 << 20
"""Most bytes of the description of a bag, which is read as a whole."""


def recording_name(paths: Sequence[Path]) -> str:
    """Return the name of a recording: its file, and the number of further files."""
    first = resolved(paths[0]).name or str(paths[0])
    return first if len(paths) == 1 else f"{first} and {len(paths) - 1} more"


def unreadable(paths: Sequence[Path], error: Exception) -> ConfigError:
    """Return the error for a recording that cannot be read, with tools for a repair."""
    text = f"{recording_name(paths)} cannot be read as a recording: {reason(error)}"
    if not isinstance(error, OSError):  # the system did not refuse to read it
        text += f"; {_repair(paths)}"
    return ConfigError(text)


def _repair(paths: Sequence[Path]) -> str:
    """Return which tools may repair a damaged recording."""
    files = [each for path in paths for each in (path, *path.glob("*"))]
    suffixes = {file.suffix for file in files if not file.is_dir()}
    if ROS1 in suffixes:
        return "if the file was not closed, `rosbag reindex` repairs it"
    folder = "`ros2 bag reindex` repairs the metadata.yaml of its folder"
    if ".mcap" in suffixes:
        return f"if the file was not closed, `mcap recover` repairs it, and {folder}"
    return f"`sqlite3 FILE .recover` reads what is left of a .db3 file, and {folder}"


def reason(error: Exception) -> str:
    """Return why a file could not be read, for people."""
    text = str(error).strip().partition("\n")[0].rstrip(".")
    if not text or isinstance(error, AssertionError | LookupError | TypeError):
        return "it is damaged or cut off"
    return text[:200]


def dialect_of(paths: Sequence[Path]) -> DialectName:
    """Return the ROS of files by their names, after a check that they can be opened.

    Raises:
        ConfigError: If a file is missing, is no recording, or would never end.

    """
    kinds: set[DialectName] = set()
    for path in paths:
        if not path.exists():
            raise ConfigError(f"{path}: there is no such file or folder")
        _refuse_endless(path)
        if path.is_dir() and not (path / METADATA).exists():
            raise ConfigError(
                f"{path}: there is no metadata.yaml in this folder, so it is not a bag "
                f"of ROS 2; give the .mcap or .db3 file in it instead, or write the "
                f"metadata.yaml with `ros2 bag reindex`"
            )
        if path.is_file() and path.suffix not in (ROS1, *ROS2):
            raise ConfigError(
                f"{path} is not the name of a recording; expected .bag, .mcap, .db3, "
                f"or the folder of a bag of ROS 2"
            )
        kinds.add("ros1" if path.suffix == ROS1 and path.is_file() else "ros2")
    if len(kinds) > 1:
        raise ConfigError("bags of ROS 1 and of ROS 2 cannot be played as one")
    return kinds.pop()


def _refuse_endless(path: Path) -> None:
    """Refuse files on which a reader would block for ever."""
    refuse_special(path)
    if not path.is_dir():
        return
    for entry in path.iterdir():
        if entry.exists():  # a dangling link is left to the reader
            refuse_special(entry)
    about = path / METADATA
    size = about.stat().st_size if about.is_file() else 0
    if size > LARGEST_METADATA:
        raise ConfigError(
            f"{about}: got {size} bytes, expected at most {LARGEST_METADATA} for the "
            f"description of a bag"
        )


def opened(
    paths: Sequence[Path], dialect: DialectName
) -> "tuple[AnyReader, DialectName]":
    """Open files; return their reader, and the ROS of their messages."""
    from rosbags.highlevel import AnyReader
    from rosbags.rosbag2 import Reader
    from rosbags.rosbag2.reader import DirectoryReader

    from webmap.bags.mcap_file import McapFile

    try:
        # Bags of ROS 2 hold the definitions of their types only since Iron.
        reader = AnyReader([*paths], default_typestore=_usual_types(dialect))
        for each in reader.readers:
            if isinstance(each, Reader) and isinstance(each.storage, DirectoryReader):
                each.storage.STORAGE_PLUGINS = {
                    **each.storage.STORAGE_PLUGINS,
                    "mcap": McapFile,
                }
            elif isinstance(each, Reader) and each.path.suffix == ".mcap":
                each.storage = McapFile(each.path)
        reader.open()
    except Exception as error:
        raise unreadable(paths, error) from None
    if any(file.dialect == "ros1" for file in mcap_files(reader)):
        dialect, reader.is2 = "ros1", False
    return reader, dialect


def mcap_files(reader: "AnyReader") -> "list[McapFile]":
    """Return the MCAP files that a reader reads."""
    from rosbags.rosbag2 import Reader

    from webmap.bags.mcap_file import McapFile

    found: list[object] = []
    for each in reader.readers:
        if isinstance(each, Reader):
            found += [each.storage, *getattr(each.storage, "storages", ())]
    return [storage for storage in found if isinstance(storage, McapFile)]


def why_unreadable(connection: "Connection") -> str | None:
    """Return why the messages of a topic cannot be decoded, if they cannot."""
    from webmap.bags.mcap_file import McapFile

    owner = connection.owner
    return owner.unreadable.get(connection.id) if isinstance(owner, McapFile) else None


def is_json(connection: "Connection") -> bool:
    """Return whether the messages of a topic are JSON."""
    from rosbags.interfaces import ConnectionExtRosbag2

    ext = connection.ext
    return isinstance(ext, ConnectionExtRosbag2) and ext.serialization_format == "json"


def add_defaults(reader: "AnyReader", dialect: DialectName) -> None:
    """Add the common types that the file itself does not define to a reader."""
    known = reader.typestore.fielddefs
    if all(connection.msgtype in known for connection in reader.connections):
        return
    usual = _usual_types(dialect).fielddefs
    reader.typestore.register({n: usual[n] for n in usual if n not in known})


def _usual_types(dialect: DialectName) -> "Typestore":
    """Return the types of a release in which most recordings can be read."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(
        Stores.ROS1_NOETIC if dialect == "ros1" else Stores.ROS2_HUMBLE
    )


def is_latched_in_file(connection: "Connection") -> bool:
    """Return whether a topic latches by what the file has about it."""
    from rosbags.interfaces import ConnectionExtRosbag1, QosDurability

    if isinstance(connection.ext, ConnectionExtRosbag1):
        return bool(connection.ext.latching)
    durable = QosDurability.TRANSIENT_LOCAL
    return any(q.durability == durable for q in connection.ext.offered_qos_profiles)
