"""Definitions in IDL, as ``rosidl`` generates them, as texts of ``.msg`` files.

Only what the generator of ROS writes is read: modules, structures, constants, and
``typedef`` of arrays. Enumerations, unions and arrays of arrays are refused.
"""

import re
from collections.abc import Iterator

from webmap.base.errors import ConfigError

_HEADS = ("====", "IDL:", "#")
_SPACE = re.compile(r"(?:\s|//[^\n]*|/\*(?:[^*]|\*(?!/))*+\*/)*+")
_TOKEN = re.compile(
    r'"(?:[^"\\\n]|\\.)*"|[A-Za-z_][A-Za-z0-9_]*(?:::[A-Za-z_][A-Za-z0-9_]*)*|'
    r"[-+]?[0-9][0-9A-Za-z_.+-]*|\S"
)
_NUMBER = re.compile(r"[0-9]{1,10}")
_DEFAULT = re.compile(r"[-+]?[0-9][0-9.e+-]*|TRUE|FALSE|True|False")

_TYPES = {
    **{"boolean": "bool", "octet": "byte", "float": "float32", "double": "float64"},
    **{"short": "int16", "long": "int32", "long long": "int64"},
    **{"unsigned short": "uint16", "unsigned long": "uint32"},
    **{"unsigned long long": "uint64"},
}
_PLAIN = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
_WORDS = ("unsigned", "long", "short")
_HIDDEN = "structure_needs_at_least_one_member"
"""The only field of a structure that has none."""


def messages_of(text: str) -> dict[str, str]:
    """Return the text of each structure in the language of ``.msg`` files.

    Args:
        text: One or more files of IDL, each after a line such as
            ``IDL: std_msgs/msg/Header``.

    Raises:
        ConfigError: If the text is not such IDL.

    """
    lines = (line for line in text.splitlines() if not line.startswith(_HEADS))
    return _Idl("\n".join(lines)).found


class _Idl:
    """The structures of a text; ``found`` has them by name."""

    def __init__(self, text: str) -> None:
        self.found: dict[str, str] = {}
        self._aliases: dict[str, str] = {}
        self._tokens = _tokens(text)
        self._next = next(self._tokens, "")
        self._default = ""
        while self._next:
            self._definition(())

    def _take(self, expected: str = "") -> str:
        token = self._next
        if not token or (expected and token != expected):
            raise ConfigError(
                f"the IDL has {token or 'its end'} where {expected or 'more'} is "
                "expected"
            )
        self._next = next(self._tokens, "")
        return token

    def _skip(self, end: str) -> None:
        while self._take() != end:
            pass

    def _definition(self, scope: tuple[str, ...]) -> None:
        self._annotations()
        word = self._take()
        if word == "module":
            inner = (*scope, self._take())
            if len(inner) > 4:
                raise ConfigError(f"the IDL has modules in {'::'.join(inner)}")
            self._take("{")
            while self._next != "}":
                self._definition(inner)
            self._take("}")
        elif word == "typedef":
            type = self._type(scope)
            name, size = self._take(), self._size()
            self._aliases["::".join((*scope, name))] = self._joined(type, size)
        elif word == "struct":
            self._struct((*scope, self._take()))
        elif word == "const":
            while self._next != ";":
                self._take()
        else:
            raise ConfigError(
                f"the IDL has {word!r}; expected module, struct, typedef or const"
            )
        self._take(";")

    def _struct(self, path: tuple[str, ...]) -> None:
        lines = []
        self._take("{")
        while self._next != "}":
            self._annotations()
            default, type = self._default, self._type(path[:-1])
            while True:
                name, size = self._take(), self._size()
                if name != _HIDDEN:
                    lines.append(f"{self._joined(type, size)} {name} {default}")
                if self._next != ",":
                    break
                self._take(",")
            self._take(";")
        self._take("}")
        self.found["/".join(path)] = "\n".join(lines)

    def _annotations(self) -> None:
        """Skip annotations; keep the value of ``@default``."""
        self._default = ""
        while self._next == "@":
            self._take()
            name = self._take()
            if self._next == "(":
                inside, depth = [], 0
                while True:
                    inside.append(self._take())
                    depth += {"(": 1, ")": -1}.get(inside[-1], 0)
                    if not depth:
                        break
                if name == "default" and _DEFAULT.fullmatch(inside[-2]):
                    self._default = inside[-2]

    def _type(self, scope: tuple[str, ...]) -> str:
        """Return a type in the language of ``.msg`` files."""
        word = self._take()
        if word in _WORDS:
            while self._next in _WORDS:
                word += f" {self._take()}"
        if word == "sequence":
            self._take("<")
            type, bound = self._type(scope), ""
            if self._next == ",":
                self._take()
                bound = f"<={self._number()}"
            self._take(">")
            return self._joined(type, f"[{bound}]")
        if word == "string" and self._next == "<":
            self._take()
            bound = self._number()
            self._take(">")
            return f"string<={bound}"
        word = _TYPES.get(word, word)
        if word in (*_TYPES.values(), *_PLAIN, "char", "string"):
            return word
        if word == "wstring" or " " in word:
            return word  # not a type of messages; refused with its name
        for depth in range(len(scope), -1, -1):
            alias = self._aliases.get("::".join((*scope[:depth], word)))
            if alias is not None:
                return alias
        return "/".join(word.split("::") if "::" in word else (*scope, word))

    def _size(self) -> str:
        """Return the size of an array after its name, if there is one."""
        if self._next != "[":
            return ""
        self._take()
        size = self._number()
        self._take("]")
        return f"[{size}]"

    def _number(self) -> str:
        token = self._take()
        if not _NUMBER.fullmatch(token):
            raise ConfigError(f"the IDL has {token} where a number is expected")
        return token

    def _joined(self, type: str, size: str) -> str:
        if (size and "[" in type) or self._next == "[":
            raise ConfigError("the IDL has an array of arrays, which ROS has not")
        return type + size


def _tokens(text: str) -> Iterator[str]:
    at = 0
    while True:
        space = _SPACE.match(text, at)
        assert space is not None  # it matches nothing, too
        token = _TOKEN.match(text, space.end())
        if token is None:
            return
        if token[0] == "/":
            raise ConfigError("the IDL has a comment without an end")
        yield token[0]
        at = token.end()
