"""WebMap's own ES modules and style sheets as browsers get them: few, and small.

A page of many small modules waits for one round trip after another, and each request
costs the browser some milliseconds. So the modules that a page starts with are served
in five, and all others in one, in the order of their imports, each in a function of its
own. Every module keeps its address and is one instance: at the address of one that is
served within another is a module that exports the same objects. The style sheets of
features are served as one too.

Comments on lines of their own are left out, and their lines stay empty, so that lines
have the same numbers everywhere. A source map has the sources as they were written; a
browser loads it for its debugger only.

The modules are WebMap's own and written in one style, which :func:`served_modules`
checks: named imports and exports, each on lines of its own. Modules of users are served
as they are.
"""

import json
import posixpath
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

STARTS = (
    "web/opening.js",
    "web/page.js",
    "web/drive.js",
    "features/stop/stop_button.js",
    "features/drive/teleop.js",
)
"""What a page loads first: its first socket, the picture, the connection to the gate,
STOP, driving.

The first one is small: it is served with what it needs itself. What one of the others
shares with any other module is served with the second. A page loads these two once.
"""

PARTS = "parts.js"
"""The module with all others, which a page loads when its first picture is there."""

PART_FOLDERS = ("console/", "features/")
"""Where the modules are that a page gets from :data:`PARTS`: browser parts."""

PART_SHEETS = "parts.css"
"""The style sheet of these browser parts."""

_SHEET_FOLDERS = ("features/", "web/tools/")
"""Where these sheets are; a page starts with those of the console."""

SHARED_SHEET = "web/style/controls.css"
"""The style sheet that those of features import."""

_IMPORT = re.compile(r'^import (\{[^}]*\}) from "(\.[^"]+)";$', re.M)
_EXPORT = re.compile(
    r"^export (?P<default>default )?"
    r"(?=(?:async )?(?:function|class|const) (?P<name>\w+))",
    re.M,
)
_OTHER = re.compile(r"^(?:import|export)\b.*", re.M)
_COMMENT = re.compile(r"^[ \t]*(?://.*|/\*[^*]*\*+(?:[^/*][^*]*\*+)*/[ \t]*)$", re.M)
_SHEET = re.compile(r'^@import url\("([^"]+)"\);$', re.M)


@dataclass(frozen=True, slots=True)
class _Module:
    name: str
    source: str
    needs: tuple[str, ...]
    exports: Mapping[str, str]
    """The local name of each exported one."""

    @property
    def object(self) -> str:
        """The name of the object with the exports, unique in WebMap."""
        return "$" + re.sub(r"\W", "_", self.name.removesuffix(".js"))


def served_modules(
    sources: Mapping[str, str], starts: Iterable[str] = STARTS
) -> dict[str, str]:
    """Return what is served at the address of each module, and the source maps.

    Args:
        sources: The text of each module by name, such as ``"web/page.js"``.
        starts: The modules that a page loads at once.

    Returns:
        Texts by name, also of :data:`PARTS`. It exports ``parts``, the exports of each
        module in it that has a default export, by name. The source map of ``x.js`` is
        ``x.js.map``.

    Raises:
        ValueError: If a module has an import or export of another form, imports a
            module that is not there, or the imports form a circle.

    """
    modules = {name: _read(name, source) for name, source in sources.items()}
    first = tuple(starts)
    owners = _owners(modules, first)
    # The page itself comes as early as it can.
    ordered = _in_order(modules, *first, *modules)
    texts = {}
    for name, module in modules.items():
        if owners[name] != name:
            texts[name] = _reference(module, owners[name])
    for owner in (*first, PARTS):
        within = [one for one in ordered if owners[one.name] == owner]
        exports = _parts(within) if owner == PARTS else _exports(modules[owner])
        text, texts[owner + ".map"] = _together(owner, within, modules, owners)
        address = posixpath.basename(owner)
        texts[owner] = f"{text}{exports}//# sourceMappingURL={address}.map\n"
    return texts


def served_sheets(
    sources: Mapping[str, str], shared: str = SHARED_SHEET
) -> dict[str, str]:
    """Return each style sheet with the sheets that it imports in place of the imports.

    :data:`PART_SHEETS` is among them.

    Args:
        sources: The text of each sheet by name, such as ``"web/webmap.css"``.
        shared: A sheet that many others import; this import stays, and a browser loads
            the sheet once.

    Raises:
        ValueError: If an import has another form, or that of ``shared`` is not the
            first line.
        KeyError: If an import names no sheet.

    """
    texts = {}
    for name in sources:
        text = _sheet(name, name, sources, shared).lstrip()
        first, _, rest = text.partition("\n")
        if "@import" in (rest if _SHEET.fullmatch(first) else text):
            raise ValueError(f"{name} has an import of another form or after rules")
        texts[name] = text
    texts[PART_SHEETS] = _part_sheets(sources, shared)
    return texts


def _part_sheets(sources: Mapping[str, str], shared: str) -> str:
    """Return the sheets of all browser parts but those that a page starts with."""
    first = f'@import url("{_address(shared, PART_SHEETS)}");'
    text = first + "\n"
    for name in sources:
        own = name.startswith(_SHEET_FOLDERS)
        if own and name.removesuffix(".css") + ".js" not in STARTS:
            sheet = _sheet(name, PART_SHEETS, sources, shared)
            text += sheet.lstrip().removeprefix(first)
    return text


def _sheet(name: str, seen_from: str, sources: Mapping[str, str], shared: str) -> str:
    def imported(found: re.Match[str]) -> str:
        needed = _beside(name, found[1])
        if needed == shared:
            return f'@import url("{_address(shared, seen_from)}");'
        return _sheet(needed, seen_from, sources, shared)

    return _SHEET.sub(imported, without_comments(sources[name]))


def _read(name: str, source: str) -> _Module:
    imports, exports = _IMPORT.findall(source), list(_EXPORT.finditer(source))
    if len(imports) + len(exports) != len(_OTHER.findall(source)):
        raise ValueError(f"{name} has an import or export of another form")
    return _Module(
        name,
        source,
        tuple(_beside(name, address) for _, address in imports),
        {"default" if one["default"] else one["name"]: one["name"] for one in exports},
    )


def _beside(name: str, address: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(name), address))


def _address(of: str, seen_from: str) -> str:
    address = posixpath.relpath("/" + of, "/" + posixpath.dirname(seen_from))
    return address if address.startswith(".") else "./" + address


def _in_order(modules: Mapping[str, _Module], *starts: str) -> list[_Module]:
    """Return modules and all that they need, each after what it needs itself."""
    done: dict[str, _Module] = {}

    def visit(name: str, above: tuple[str, ...]) -> None:
        if name in above or name not in modules:
            raise ValueError(
                f"{above[-1]} imports {name}, which is missing or a circle"
            )
        if name in done:
            return
        for need in modules[name].needs:
            visit(need, (*above, name))
        done[name] = modules[name]

    for start in starts:
        visit(start, ())
    return list(done.values())


def _owners(modules: Mapping[str, _Module], starts: tuple[str, ...]) -> dict[str, str]:
    """Return the module with which each module is served."""
    users: dict[str, list[str]] = {name: [] for name in modules}
    for start in starts:
        for module in _in_order(modules, start):
            users[module.name].append(start)
    needed_later = {
        module.name
        for name, entries in users.items()
        if not entries
        for module in _in_order(modules, name)
    }
    owners = {}
    for name, entries in users.items():
        if not entries:
            owners[name] = PARTS
        elif starts[0] in entries or name in starts:
            owners[name] = entries[0]
        else:
            alone = len(entries) == 1 and name not in needed_later
            owners[name] = entries[0] if alone else starts[1]
    return owners


def _reference(module: _Module, owner: str) -> str:
    """Return a module that exports what another one has of it."""
    return (
        f'import {{ {module.object} }} from "{_address(owner, module.name)}";\n'
        + _exports(module)
    )


def _exports(module: _Module) -> str:
    names = [name for name in module.exports if name != "default"]
    text = (
        f"export const {{ {', '.join(names)} }} = {module.object};\n" if names else ""
    )
    if "default" in module.exports:
        text += f"export default {module.object}.default;\n"
    return text


def _parts(within: Iterable[_Module]) -> str:
    """Return the export of the modules that are browser parts."""
    pairs = (
        f"{json.dumps(module.name)}: {module.object},\n"
        for module in within
        if "default" in module.exports
    )
    return f"export const parts = {{\n{''.join(pairs)}}};\n"


def _together(
    owner: str,
    within: list[_Module],
    modules: Mapping[str, _Module],
    owners: Mapping[str, str],
) -> tuple[str, str]:
    """Return the text of some modules as one, and its source map."""
    others: dict[str, dict[str, None]] = {}
    for module in within:
        for need in module.needs:
            if owners[need] != owner:
                objects = others.setdefault(owners[need], {})
                objects[modules[need].object] = None
    text = "".join(
        f'import {{ {", ".join(objects)} }} from "{_address(other, owner)}";\n'
        for other, objects in others.items()
    )
    sections = []
    for module in within:
        text += f"const {module.object} = (() => {{\n"
        sections.append(_section(module, owner, text.count("\n")))
        text += _body(module, modules)
        pairs = ", ".join(
            name if name == local else f"{name}: {local}"
            for name, local in module.exports.items()
        )
        text += f"\nreturn {{ {pairs} }};\n}})();\n"
    text += f"export {{ {', '.join(module.object for module in within)} }};\n"
    return text, json.dumps({"version": 3, "sections": sections})


def _body(module: _Module, modules: Mapping[str, _Module]) -> str:
    def imported(found: re.Match[str]) -> str:
        names = found[1].replace(" as ", ": ")
        return f"const {names} = {modules[_beside(module.name, found[2])].object};"

    text = _EXPORT.sub("", _IMPORT.sub(imported, module.source))
    return without_comments(text)


def without_comments(text: str) -> str:
    """Return a text without comments on lines of their own, which stay empty."""
    return _COMMENT.sub(lambda found: "\n" * found[0].count("\n"), text)


def _section(module: _Module, owner: str, line: int) -> dict[str, object]:
    """Return the part of a source map for a module that begins at a line."""
    # Each line is that line of the source: the same column, the next line.
    mappings = "AAAA" + ";AACA" * module.source.count("\n")
    return {
        "offset": {"line": line, "column": 0},
        "map": {
            "version": 3,
            "sources": [_address(module.name, owner)],
            "sourcesContent": [module.source],
            "names": [],
            "mappings": mappings,
        },
    }
