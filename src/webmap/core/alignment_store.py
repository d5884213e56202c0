"""Alignments saved on a page, kept over restarts.

Each is one small file in the state folder. The file also keeps the alignment that a
program or a fleet file stated at the time of saving. A saved alignment is used until
the stated one changes; then the stated one is used.
"""

import contextlib
import datetime
import hashlib
import json
import logging
from pathlib import Path
from urllib.parse import urlsplit

from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose
from webmap.base.plain_files import LARGEST_STATE, read_file, write_file
from webmap.core.robot import Robot
from webmap.gate.locks import state_folder
from webmap.poses.alignment import alignment, alignments, numbers
from webmap.ros.bridge import Bridge

log = logging.getLogger("webmap.alignment")

AlignmentNumbers = tuple[float, float, float]


class AlignmentStore:
    """The alignment files of one folder.

    Args:
        folder: The folder; the state folder if not given.

    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._stated: dict[str, AlignmentNumbers | None] = {}
        """The alignment of each name that was stated before the saved one replaced
        it."""

    def path(self, name: str) -> Path:
        """Return the path of the file of a bridge or a robot."""
        digest = hashlib.sha256(name.encode()).hexdigest()[:24]
        return (self._folder or state_folder()) / f"{digest}.alignment"

    def restore_bridge(self, bridge: Bridge) -> None:
        """Apply a bridge's saved alignment unless another one was stated since."""
        saved = self._saved(name_of(bridge), alignments.stated(bridge))
        if saved is not None:
            alignments.set(bridge, saved)

    def restore(self, robot: Robot) -> None:
        """Apply the saved alignments of a robot and of its bridge."""
        bridge = robot.pose_source.bridge
        if bridge is None or robot.motion.is_far:  # then its agent aligns it
            return
        self.restore_bridge(bridge)
        own = robot.pose_source.own_alignment
        saved = self._saved(name_of(bridge, robot.name), own)
        if saved is not None:
            robot.set_alignment(*numbers(saved))

    def save(self, name: str, before: Pose | None, now: Pose, by: str) -> str:
        """Save an alignment and return the file's path.

        Args:
            name: The name of the bridge or the robot; see :func:`name_of`.
            before: The alignment until now; None if none was stated.
            now: The alignment from now on.
            by: The name of the operator who saves it.

        Raises:
            OSError: If the folder cannot be written to.

        """
        stated = self._stated.setdefault(name, _of(before))
        path = self.path(name)
        content = {
            "alignment": numbers(now),
            "instead_of": stated,
            "of": name,
            "by": by,
            "date": datetime.datetime.now().astimezone().date().isoformat(),
        }
        write_file(path, json.dumps(content).encode())
        return str(path)

    def forget(self, name: str) -> None:
        """Delete a saved alignment; another one is used from now on."""
        with contextlib.suppress(OSError):
            self.path(name).unlink()

    def _saved(self, name: str, stated: Pose | None) -> Pose | None:
        """Return the alignment saved in place of the stated one, or None."""
        if name in self._stated:
            return None  # already applied or refused
        path = self.path(name)
        try:
            content = json.loads(read_file(path, LARGEST_STATE, links=False))
            saved = alignment(*content["alignment"])
            instead_of = content["instead_of"]
        except FileNotFoundError:
            return None
        except (
            OSError,
            ValueError,
            KeyError,
            TypeError,
            RecursionError,
            ConfigError,
        ) as error:
            log.warning("%s cannot be read (%s): saved alignment ignored", path, error)
            return None
        self._stated[name] = _of(stated)
        if (None if instead_of is None else tuple(instead_of)) != _of(stated):
            log.warning(
                "%s: the alignment that was saved on a page is no longer used, because "
                "the configuration now states another one",
                name,
            )
            with contextlib.suppress(OSError):
                path.unlink()
            return None
        return saved


def name_of(bridge: Bridge, robot: str = "") -> str:
    """Return the key of a saved alignment, without the secrets of the bridge's URL."""
    parts = urlsplit(bridge.url)
    host = parts.hostname or ""
    port = f":{parts.port}" if parts.port else ""
    return f"{parts.scheme}://{host}{port}{parts.path} {robot}".strip()


def _of(pose: Pose | None) -> AlignmentNumbers | None:
    return None if pose is None else numbers(pose)


store = AlignmentStore()
"""The alignment store of this process."""
