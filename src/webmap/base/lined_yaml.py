"""YAML files that people edit, with the line number of each value."""

from pathlib import Path
from typing import Any

import yaml

from webmap.base.errors import ConfigError
from webmap.base.plain_files import read_file
from webmap.base.text import one_line

LARGEST = 1 << 18
"""Most bytes of a file; a megabyte takes half a minute to read."""

DEEPEST = 50
"""Greatest depth of nested values."""

MOST_VALUES = 40_000
"""Most keys and values of a file."""

MOST_DIGITS = 100
"""Most characters of a number; one with many parts, as 1:1:1, takes minutes to read."""


class LinedYaml:
    """The values of a YAML file, with line numbers; JSON is YAML, too.

    Aliases are refused: a few nested ones expand beyond any memory. Duplicate keys are
    refused, since one of them would be lost.

    Args:
        file: The file.
        texts: Whether all values stay strings, so that "yes" does not become a boolean.

    Raises:
        ConfigError: If the file cannot be read or is not such YAML; the error message
            names file and line.

    """

    def __init__(self, file: Path, *, texts: bool = False) -> None:
        self.file = file
        self._lines: dict[tuple[str | int, ...], int] = {}
        try:
            data = read_file(file, LARGEST)
            loader = _Texts(data) if texts else _Loader(data)
            node = loader.get_single_node()
            if node is not None:
                self._note((), node)
            self.data: Any = None if node is None else loader.construct_document(node)
            """The values, as plain data; None if the file is empty."""
        except ConfigError:
            raise
        except OSError as error:
            raise ConfigError(f"{file}: {error.strerror}") from None
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line = f":{mark.line + 1}" if mark else ""
            message = " ".join(str(error.problem or error.context).split())[:200]
            raise ConfigError(f"{file}{line}: this is not YAML: {message}") from None
        except RecursionError:
            raise ConfigError(f"{file}: values are nested too deep") from None
        except (yaml.YAMLError, ValueError) as error:
            message = " ".join(str(error).split())[:200]
            raise ConfigError(f"{file}: this is not YAML: {message}") from None

    def wrong(self, path: tuple[str | int, ...], message: str) -> ConfigError:
        """Return an error with file and line.

        Args:
            path: Keys and indices of the wrong value; for a missing value, the line is
                that of the part that lacks it.
            message: The wrong value and the expected one.

        """
        while path and path not in self._lines:
            path = path[:-1]
        line = self._lines.get(path, 1)
        # Text of a file must not control the terminal that shows it.
        return ConfigError(f"{self.file}:{line}: {one_line(message)}")

    def _note(self, path: tuple[str | int, ...], node: yaml.Node) -> None:
        self._lines[path] = node.start_mark.line + 1
        if isinstance(node, yaml.SequenceNode):
            for index, each in enumerate(node.value):
                self._note((*path, index), each)
        elif isinstance(node, yaml.MappingNode):
            for key, each in node.value:
                if not isinstance(key, yaml.ScalarNode):
                    continue
                if (*path, key.value) in self._lines:
                    raise yaml.MarkedYAMLError(
                        problem=f'the key "{key.value}" is defined twice',
                        problem_mark=key.start_mark,
                    )
                self._note((*path, key.value), each)
                self._lines[(*path, key.value)] = key.start_mark.line + 1


class _Bounded(yaml.composer.Composer):
    """Refuses values that take long to read, before they are built."""

    _depth = 0
    _values = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()  # type: ignore[attr-defined]
        self._depth += 1
        self._values += 1
        problem = None
        if isinstance(event, yaml.AliasEvent):
            problem = "aliases (*name) are not allowed"
        elif self._depth > DEEPEST:
            problem = f"values are nested more than {DEEPEST} deep"
        elif self._values > MOST_VALUES:
            problem = f"it has more than {MOST_VALUES} keys and values"
        if problem is not None:
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        number = isinstance(node, yaml.ScalarNode) and node.tag in _NUMBERS
        if node is not None and number and len(node.value) > MOST_DIGITS:
            raise yaml.MarkedYAMLError(
                problem=f"a number has more than {MOST_DIGITS} characters",
                problem_mark=node.start_mark,
            )
        return node


_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")


class _Loader(_Bounded, yaml.SafeLoader):
    pass


class _Texts(_Bounded, yaml.BaseLoader):
    pass
