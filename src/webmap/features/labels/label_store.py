"""Labels, and the files that store them."""

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.identifiers import generate_id
from webmap.base.plain_files import LARGEST_STATE, read_file, write_file
from webmap.config import checks
from webmap.config.checks import KeyPath, Mistakes, expecting, key_path_text
from webmap.config.reading import Config, read

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

_STORE = re.compile(r"[A-Za-z0-9_-]{1,40}")
_KIND = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")


def _name(value: Any) -> str:
    name = checks.text(value).strip()
    if len(value) > MAX_NAME:
        raise ConfigError(f"at most {MAX_NAME} characters")
    return "".join(c if c.isprintable() else " " for c in name)


def _kind(value: Any) -> str:
    if value and not _KIND.fullmatch(checks.text(value)):
        raise ConfigError("letters, digits, '-' and '_'")
    return value or ""


class LabelConfig(Config, frozen=True):
    """A label in a file: a named place on the map."""

    name: Annotated[str, expecting(f"a text of 1 to {MAX_NAME} characters", _name)]
    x: Annotated[float, checks.finite("a number of metres")]
    y: Annotated[float, checks.finite("a number of metres")]
    icon: Annotated[str, checks.one_of(*ICONS)] = "pin"
    kind: Annotated[str, expecting("the name of a class", _kind)] = ""
    """An additional CSS class."""

    yaw: Annotated[float, checks.finite("a number of radians")] | None = None
    """Heading of a robot at the label; None for any."""


class Label(LabelConfig, frozen=True):
    """A label on a map."""

    id: str = ""
    kept: bool = False
    """Whether the label was added on a page."""

    @property
    def plain(self) -> dict[str, Any]:
        """The label as in a file."""
        return {key: getattr(self, key) for key in LabelConfig.__struct_fields__}


def read_labels(data: Any, path: KeyPath, mistakes: Mistakes) -> tuple[Label, ...]:
    """Return labels from plain data: a list of tables, or a table with ``labels``.

    Args:
        data: Data as read from YAML, JSON or TOML.
        path: The keys that lead to the data, for errors.
        mistakes: The list for every mistake.

    """
    if isinstance(data, Mapping) and set(data) == {"labels"}:
        data = data["labels"]
    if isinstance(data, str | bytes | Mapping) or not isinstance(data, Iterable):
        mistakes.add(path, f"got {checks.show(data)}, expected a list of labels")
        return ()
    found = []
    for number, each in enumerate(data):
        if number == MAX_LABELS:
            text = f"expected at most {MAX_LABELS} labels, got more"
            mistakes.add((*path, number), text)
            break
        plain = each.plain if isinstance(each, Label) else each
        label = read(LabelConfig, plain, (*path, number), mistakes)
        if label is not None:
            found.append(Label(**msgspec.structs.asdict(label), id=f"c{number}"))
    return tuple(found)


def given_labels(data: Any, of: str) -> tuple[Label, ...]:
    """Return labels from plain data, as :func:`read_labels` does.

    Args:
        data: The data.
        of: The name of the source, for people.

    Raises:
        ConfigError: If a label is not valid; the error has its number and its key.
    """
    mistakes = Mistakes()
    labels = read_labels(data, (of,), mistakes)
    mistakes.refuse("")
    return labels


def label_file(file: str | Path) -> tuple[Label, ...]:
    """Return the labels of a YAML or JSON file.

    Raises:
        ConfigError: If the file is not of this format, or a label is not valid; the
            error has the file and the line.
    """
    from webmap.base.lined_yaml import LinedYaml

    document, mistakes = LinedYaml(Path(file)), Mistakes()
    labels = read_labels(document.data, ("labels",), mistakes)
    if mistakes.found:
        path, text = mistakes.found[0]
        place = path if isinstance(document.data, Mapping) else path[1:]
        raise document.wrong(place, f"{key_path_text(path)}: {text}")
    return labels


def new_label(data: Any) -> Label:
    """Return a label that was added on a page.

    Raises:
        ConfigError: If the data is not valid; the error names the key.
    """
    mistakes = Mistakes()
    label = read(LabelConfig, data, (), mistakes)
    mistakes.refuse("")
    assert label is not None, "a table without a mistake is a label"
    return Label(**msgspec.structs.asdict(label), id=generate_id(), kept=True)


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
    moved = new_label({**label.plain, "x": data.get("x"), "y": data.get("y")})
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
            expected = "letters, digits, '-' and '_', up to 40"
            raise ConfigError(f"name: got {checks.show(name)}, expected {expected}")
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
        labels = given_labels(data, self.file.name)
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
            {key: value for key, value in label.plain.items() if value != ""}
            for label in labels
        ]
        text = json.dumps({"labels": plain}, ensure_ascii=False, indent=1)
        write_file(self.file, text.encode())
