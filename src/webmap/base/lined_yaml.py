"""YAML files that people write by hand, and on which line of them something stands."""

from pathlib import Path
from typing import Any

import yaml

from webmap.base.errors import ConfigError
from webmap.base.outside_text import one_line
from webmap.base.plain_files import read_file

LARGEST = 1 << 18
"""Bytes that a file may have; a megabyte takes half a minute to read."""

DEEPEST = 50
"""Values in one another."""

MOST_VALUES = 40_000
"""Keys and values of a file."""

MOST_DIGITS = 100
"""Characters of a number; one of very many, such as 1:1:1, takes minutes to read."""


class LinedYaml:
    """What a YAML file says, and where; JSON is YAML, too.

    Aliases are refused: a few of them in one another stand for more than any memory
    holds. So is a key that is there twice, of which one would be lost.

    Args:
        file: The file.
        texts: Whether to make nothing but texts, so that "yes" is not taken for a 1.

    Raises:
        ConfigError: If it cannot be read or is no such YAML; file and line are named.

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
            """What it says, as plain values; None if it says nothing."""
        except ConfigError:
            raise
        except OSError as error:
            raise ConfigError(f"{file}: {error.strerror}") from None
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line = f":{mark.line + 1}" if mark else ""
            words = " ".join(str(error.problem or error.context).split())[:200]
            raise ConfigError(f"{file}{line}: this is no YAML: {words}") from None
        except RecursionError:
            raise ConfigError(f"{file}: values are nested too deep") from None
        except (yaml.YAMLError, ValueError) as error:
            words = " ".join(str(error).split())[:200]
            raise ConfigError(f"{file}: this is no YAML: {words}") from None

    def wrong(self, way: tuple[str | int, ...], words: str) -> ConfigError:
        """Return the error that something is wrong, with file and line.

        Args:
            way: Keys and indices on the way to it; what is not there is taken to be
                where the part stands that lacks it.
            words: What was got and what was expected.

        """
        while way and way not in self._lines:
            way = way[:-1]
        line = self._lines.get(way, 1)
        # What a file holds must not steer the terminal that shows it.
        return ConfigError(f"{self.file}:{line}: {one_line(words)}")

    def _note(self, way: tuple[str | int, ...], node: yaml.Node) -> None:
        self._lines[way] = node.start_mark.line + 1
        if isinstance(node, yaml.SequenceNode):
            for index, each in enumerate(node.value):
                self._note((*way, index), each)
        elif isinstance(node, yaml.MappingNode):
            for key, each in node.value:
                if not isinstance(key, yaml.ScalarNode):
                    continue
                if (*way, key.value) in self._lines:
                    raise yaml.MarkedYAMLError(
                        problem=f'the key "{key.value}" is there twice',
                        problem_mark=key.start_mark,
                    )
                self._note((*way, key.value), each)
                self._lines[(*way, key.value)] = key.start_mark.line + 1


class _Bounded(yaml.composer.Composer):
    """Refuses what takes long to read, as soon as it is met."""

    _depth = 0
    _values = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()  # type: ignore[attr-defined]
        self._depth += 1
        self._values += 1
        problem = None
        if isinstance(event, yaml.AliasEvent):
            problem = "aliases (*name) have no place in it"
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
