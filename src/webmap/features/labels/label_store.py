"""Labels, and the files that store them."""

import json
import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.identifiers import generate_id
from webmap.base.plain_files import LARGEST_STATE, read_file, write_file
from webmap.config.checks import did_you_mean

ICONS = {
    "pin": "M12 21c-4-4.4-6-7.7-6-10.800a6 6 0 0 1 12 0c0 3.1-2 6.4-6 10.800z"
    "M12 12.500a2.3 2.3 0 1 0 0-4.6 2.3 2.3 0 0 0 0 4.6",
    "charger": "M13 3L6 13.500h5L10 21l8-11h-5.500z",
    "desk": "M3 9h18M5 9v10M19 9v10M5 13.500h6V9",
    "door": "M7 21V3.500h10V21M4 21h16M14 12.500v.5",
    "home": "M3.5 11.500L12 4l8.5 7.500M6 9.500V20h12V9.500M10 20v-6h4v6",
    "lift": "M4.5 3.500h15v17h-15zM12 3.500v17M7 10l1.5-2 1.5 2M14 14l1.5 2 1.5-2",
    "person": "M12 10.500a3.5 3.5 0 1 0 0-7 3.5 3.5 0 0 0 0 7M5 20.500c0-4 3-6.5"
    " 7-6.500s7 2.5 7 6.5",
    "shelf": "M4 3.500v17M20 3.500v17M4 9h16M4 16h16M8 9V5.500h4V9M12 16v-3.500h4V16",
    "stairs": "M3 20h4.500v-4H12v-4h4.500V8H21",
    "star": "M12 3.500l2.6 5.6 6 .7-4.5 4.1 1.2 6-5.3-3-5.3 3 1.2-6-4.5-4.1 6-.700z",
    "warning": "M12 4L2.8 20h18.400zM12 10v4.500M12 17v.5",
}
"""The icons of labels, as lines on a square of 24 units."""

MAX_LABELS = 2000
MAX_NAME = 60
FARTHEST = 1e6
"""Greatest distance from the origin, in metres."""

_KEYS = ("name", "x", "y", "icon", "kind", "yaw")
_STORE = re.compile(r"[A-Za-z0-9_-]{1,40}")
_KIND = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")


class Label(msgspec.Struct, frozen=True):
    """A named place on the map."""

    name: str
    x: float
    """In metres."""

    y: float
    """In metres."""

    icon: str = "pin"
    kind: str = ""
    """An additional CSS class."""

    yaw: float | None = None
    """Heading of a robot at the label, in radians; None for any."""

    id: str = ""
    kept: bool = False
    """Whether the label was added on a page."""


def read_labels(data: Any, of: str) -> tuple[Label, ...]:
    """Return labels from plain data: a list of tables, or a table with ``labels``.

    Args:
        data: Data as read from YAML, JSON or TOML.
        of: The name of the source, for people.

    Raises:
        ConfigError: If a label is not valid; the error has its number and its key.
    """
    if isinstance(data, Mapping) and set(data) == {"labels"}:
        data = data["labels"]
    if isinstance(data, str | bytes) or not isinstance(data, Iterable):
        raise _LabelError((), of, f"expected a list of labels, got {_show(data)}")
    found: list[Label] = []
    for number, each in enumerate(data):
        if len(found) == MAX_LABELS:
            raise ConfigError(f"{of}: expected at most {MAX_LABELS} labels, got more")
        if isinstance(each, Label):
            each = msgspec.structs.asdict(each)
            each = {key: each[key] for key in _KEYS}
        try:
            found.append(_label(each, f"{of}[{number}]"))
        except _LabelError as error:
            raise error.inside(number) from None
    return tuple(
        msgspec.structs.replace(label, id=f"c{number}")
        for number, label in enumerate(found)
    )


class _LabelError(ConfigError):
    """An error in a label, with its position in the file."""

    def __init__(self, path: tuple[str | int, ...], of: str, text: str) -> None:
        super().__init__(f"{of}: {text}" if of else text)
        self.path, self.of, self.text = path, of, text

    def inside(self, number: int) -> "_LabelError":
        return _LabelError((number, *self.path), self.of, self.text)


def label_file(file: str | Path) -> tuple[Label, ...]:
    """Return the labels of a YAML or JSON file.

    Raises:
        ConfigError: If the file is not of this format, or a label is not valid; the
            error has the file and the line.
    """
    from webmap.base.lined_yaml import LinedYaml

    document = LinedYaml(Path(file))
    try:
        return read_labels(document.data, "labels")
    except _LabelError as error:
        table = isinstance(document.data, Mapping) and set(document.data) == {"labels"}
        path = ("labels", *error.path) if table else error.path
        raise document.wrong(path, str(error)) from None


def new_label(data: Mapping[str, Any]) -> Label:
    """Return a label that was added on a page.

    Raises:
        ConfigError: If the data is not valid; the error names the key.
    """
    return msgspec.structs.replace(_label(data, ""), id=generate_id(), kept=True)


def moved_label(label: Label, data: Any) -> Label:
    """Return a label that was moved on a page.

    Args:
        label: The label before the move.
        data: A table with ``x`` and ``y`` in metres.

    Raises:
        ConfigError: If the data is not valid; the error names the key.
    """
    if not isinstance(data, Mapping):
        raise ConfigError("a label is moved to x and y, in metres")
    plain = {key: getattr(label, key) for key in _KEYS}
    moved = _label({**plain, "x": data.get("x"), "y": data.get("y")}, "")
    return msgspec.structs.replace(moved, id=label.id, kept=label.kept)


class LabelStore:
    """A file with the labels that were added on pages.

    Args:
        folder: The folder of such files.
        name: The name of the file: labels of one name are the same on every page.

    Raises:
        ConfigError: If the name is not valid as a file name.
    """

    def __init__(self, folder: Path, name: str) -> None:
        if not _STORE.fullmatch(name):
            raise ConfigError(
                f"name: letters, digits, '-' and '_', up to 40; got {_show(name)}"
            )
        self.file = folder / "labels" / f"{name}.json"

    def load(self) -> tuple[Label, ...]:
        """Return the labels of the file; none if there is no file.

        Raises:
            ConfigError: If the file cannot be read.
        """
        try:
            data = json.loads(read_file(self.file, LARGEST_STATE, links=False))
        except FileNotFoundError:
            return ()
        except (OSError, ValueError, RecursionError) as error:
            raise ConfigError(f"{self.file} cannot be read: {error}") from None
        labels = read_labels(data, self.file.name)
        return tuple(
            msgspec.structs.replace(label, id=generate_id(), kept=True)
            for label in labels
        )

    def save(self, labels: Iterable[Label]) -> None:
        """Write all labels, or leave the file unchanged.

        Raises:
            OSError: If the file cannot be written.
        """
        plain = [
            {key: getattr(label, key) for key in _KEYS if getattr(label, key) != ""}
            for label in labels
        ]
        text = json.dumps({"labels": plain}, ensure_ascii=False, indent=1)
        write_file(self.file, text.encode())


def _label(data: Any, of: str) -> Label:
    def wrong(key: object, text: str) -> ConfigError:
        shown = key if key in _KEYS else _show(key)
        return _LabelError((str(key),), f"{of}{'.' if of else ''}{shown}", text)

    if not isinstance(data, Mapping):
        raise _LabelError((), of, "expected a table with name, x and y")
    for key in data:
        if key not in _KEYS:
            hint = did_you_mean(key, _KEYS)
            raise wrong(key, f"no such key{hint}; there are {', '.join(_KEYS)}")
    name = data.get("name")
    if not isinstance(name, str) or not name.strip() or len(name) > MAX_NAME:
        raise wrong("name", f"expected 1 to {MAX_NAME} characters, got {_show(name)}")
    x, y = (_number(data.get(key), key, wrong) for key in "xy")
    icon, kind = data.get("icon") or "pin", data.get("kind") or ""
    if not isinstance(icon, str) or icon not in ICONS:
        listed = ", ".join(ICONS)
        raise wrong("icon", f"expected one of {listed}; got {_show(icon)}")
    if kind and not (isinstance(kind, str) and _KIND.fullmatch(kind)):
        raise wrong("kind", f"expected the name of a class, got {_show(kind)}")
    yaw = data.get("yaw")
    if yaw is not None:
        yaw = _number(yaw, "yaw", wrong)
    return Label("".join(c if c.isprintable() else " " for c in name.strip()), x, y,
                 icon, kind, yaw)  # fmt: skip


def _number(value: Any, key: str, wrong: Any) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or abs(value) > FARTHEST:
        unit = "radians" if key == "yaw" else "metres"
        raise wrong(key, f"expected a number of {unit}, got {_show(value)}")
    return float(value)


def _show(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
