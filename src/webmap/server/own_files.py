"""WebMap's own files for browsers, at addresses that change with their content.

All of them together have a version, made from what they contain, and each has the
address ``v-VERSION/NAME``: a browser that has it never asks again, and modules that
import each other by relative addresses have one version. Without a version a module's
name is the address of a small module with the same exports, so that modules of users
can import it.
"""

import hashlib
import os
import re
import threading
from pathlib import Path

from webmap.server.bundles import IN_PAGE, served_modules, served_sheets
from webmap.server.files import MEDIA_TYPES, File, NoSuchFile

PACKAGE = Path(__file__).parents[1]

FOLDERS = ("console/", "features/", "web/")
"""Folders of the package with files for the browser; their URLs are their paths."""

ASSETS = Path(__file__).parent / "assets"

_VERSIONED = re.compile(r"v-([0-9a-f]{16})/(.+)")


class OwnFiles:
    """The files of the package that browsers may load; for any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._paths: dict[str, Path] = {}
        self._seen: list[tuple[int, int]] | None = None
        self._files: dict[str, bytes] = {}
        self._version = ""

    def version(self) -> str:
        """Return the version of the files, which are read again if one has changed."""
        with self._lock:
            if self._seen is None or _look(self._paths) != self._seen:
                self._paths = _find()
                self._seen = _look(self._paths)
                self._files = _serve(self._paths)
                self._version = _hash(self._files)
            return self._version

    def opening(self) -> str:
        """Return the script with which a page opens its first socket."""
        return self.file(f"v-{self.version()}/{IN_PAGE}").data.decode()

    def file(self, name: str) -> File:
        """Return a file by its address below ``/_webmap/``.

        A page that was opened before the files changed gets the present ones, which its
        browser must not keep under that address.

        Raises:
            NoSuchFile: If there is none of that name.

        """
        version = self._version or self.version()
        found = _VERSIONED.fullmatch(name)
        plain = found[2] if found else name
        data = self._files.get(plain)
        if data is None:
            raise NoSuchFile
        suffix = Path(plain).suffix
        if not found and suffix == ".js":
            data = _same_module(plain, version, data)
        media_type = MEDIA_TYPES.get(suffix, "application/json")
        return File(
            data, media_type, version, unchanging=bool(found and found[1] == version)
        )


own_files = OwnFiles()
"""Those of this process."""


def _find() -> dict[str, Path]:
    """Return the path of each file by its name, in the order of names."""
    paths = {path.name: path for path in ASSETS.iterdir()}
    for folder in FOLDERS:
        for path in (PACKAGE / folder).rglob("*.*"):
            paths[path.relative_to(PACKAGE).as_posix()] = path
    return {
        name: path for name, path in sorted(paths.items()) if path.suffix in MEDIA_TYPES
    }


def _look(paths: dict[str, Path]) -> list[tuple[int, int]]:
    """Return the time of the last change and the size of each file; zeros if gone."""
    seen = []
    for path in paths.values():
        try:
            status = os.stat(path)
        except OSError:
            seen.append((0, 0))
        else:
            seen.append((status.st_mtime_ns, status.st_size))
    return seen


def _serve(paths: dict[str, Path]) -> dict[str, bytes]:
    files = {name: path.read_bytes() for name, path in paths.items()}
    for suffix, served in ((".js", served_modules), (".css", served_sheets)):
        sources = {
            name: data.decode() for name, data in files.items() if name.endswith(suffix)
        }
        files |= {name: text.encode() for name, text in served(sources).items()}
    return files


def _hash(files: dict[str, bytes]) -> str:
    content = hashlib.sha256()
    for name, data in sorted(files.items()):
        content.update(f"{name} {len(data)} ".encode())
        content.update(data)
    return content.hexdigest()[:16]


def _same_module(name: str, version: str, data: bytes) -> bytes:
    address = "../" * name.count("/") + f"v-{version}/{name}"
    address = address if address.startswith(".") else "./" + address
    text = f'export * from "{address}";\n'
    if re.search(rb"^export default ", data, re.M):
        text += f'export {{ default }} from "{address}";\n'
    return text.encode()
