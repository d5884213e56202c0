"""Alignments that people saved on a page, kept over restarts.

They are in the state folder, one small file each. A file also says which alignment it
was saved in place of, as a program or a fleet file had stated that. So what was saved
on a page holds until somebody states another one: the newer word counts.
"""

import contextlib
import datetime
import hashlib
import json
import logging
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose
from webmap.base.plain_files import LARGEST_STATE, read_file, write_file
from webmap.gate.kept.locks import state_folder
from webmap.poses.alignment import alignment, alignments, numbers
from webmap.ros.bridge import Bridge

if TYPE_CHECKING:
    from webmap.core.robot import Robot

log = logging.getLogger("webmap.alignment")

Numbers = tuple[float, float, float]


class AlignmentStore:
    """The files of one folder.

    Args:
        folder: Where they are; the state folder if not given.

    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._stated: dict[str, Numbers | None] = {}
        """What was stated of each before what was saved took its place."""

    def path(self, name: str) -> Path:
        """Return the file of a bridge or a robot."""
        digest = hashlib.sha256(name.encode()).hexdigest()[:24]
        return (self._folder or state_folder()) / f"{digest}.alignment"

    def restore_bridge(self, bridge: Bridge) -> None:
        """Align a bridge as it was saved, unless something else was stated since."""
        saved = self._saved(name_of(bridge), alignments.stated(bridge))
        if saved is not None:
            alignments.set(bridge, saved)

    def restore(self, robot: "Robot") -> None:
        """Align a robot and its bridge as they were saved; see above."""
        bridge = robot.whereabouts.bridge
        if bridge is None:
            return
        self.restore_bridge(bridge)
        own = robot.whereabouts.own_alignment
        saved = self._saved(name_of(bridge, robot.name), own)
        if saved is not None:
            robot.set_alignment(*numbers(saved))

    def save(self, name: str, before: Pose | None, now: Pose, by: str) -> str:
        """Keep an alignment, and return the file's path.

        Args:
            name: Of the bridge or the robot: see :func:`name_of`.
            before: What held until now; None if nothing was stated.
            now: What holds from now on.
            by: Who says so.

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
        """Forget what was saved: it goes by another alignment from now on."""
        with contextlib.suppress(OSError):
            self.path(name).unlink()

    def _saved(self, name: str, stated: Pose | None) -> Pose | None:
        """Return what was saved in place of what is stated, if anything was."""
        if name in self._stated:
            return None  # it holds already, or was refused
        path = self.path(name)
        try:
            content = json.loads(read_file(path, LARGEST_STATE))
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
            log.warning("%s cannot be read (%s): as if nothing was saved", path, error)
            return None
        self._stated[name] = _of(stated)
        if (None if instead_of is None else tuple(instead_of)) != _of(stated):
            log.warning(
                "%s: the alignment that was saved on a page is left out, as another "
                "one was stated since",
                name,
            )
            with contextlib.suppress(OSError):
                path.unlink()
            return None
        return saved


def name_of(bridge: Bridge, robot: str = "") -> str:
    """Return what an alignment is kept under: no secrets of an address are in it."""
    parts = urlsplit(bridge.url)
    host = parts.hostname or ""
    port = f":{parts.port}" if parts.port else ""
    return f"{parts.scheme}://{host}{port}{parts.path} {robot}".strip()


def _of(pose: Pose | None) -> Numbers | None:
    return None if pose is None else numbers(pose)


store = AlignmentStore()
"""That of this process."""
