"""WebMap's own ES modules and style sheets, in few files for browsers.

A page of many small modules waits for one round trip after another, and each request
costs the browser some milliseconds. So a page loads the bundles of :data:`STARTS` and
:data:`PARTS`: each has some modules in the order of their imports, every module in a
function of its own. The page's object ``$modules`` has the exports of all by name. So
every module is one instance, also if a page loads a bundle again after a failure: at
the address of a module within a bundle is a module that exports the same objects, for
modules of users. The style sheets of features are served as one too. What is imported
by ``import()`` is in a bundle of its own, :data:`LATER`.

The console and generated pages have the first bundle in their HTML, as the script
:data:`IN_PAGE`, and do not load it.

Indentation and comments on lines of their own are left out, and lines of comments stay
empty, so that lines have the same numbers everywhere. A source map has the sources as
they were written; a browser loads it for its debugger only.

The modules are WebMap's own and written in one style, which :func:`served_modules`
checks: named imports and exports, each on lines of its own. Modules of users are served
as they are.
"""

import json
import posixpath
import re
from collections.abc import Mapping, Sequence

STARTS = ("web/opening.js", "web/page.js", "web/drive.js")
"""The bundles that a page loads first: its first socket, the picture, the connection to
the gate with STOP and driving.

Each is a module with all that it imports, if no bundle before has it.
"""

IN_PAGE = "opening_in_page.js"
"""The first bundle as a script that is not a module; its element has the address of the
bundle in ``data-from``."""

FIRST_PARTS = {
    "features/stop/stop_button.js": "web/drive.js",
    "features/drive/teleop.js": "web/drive.js",
}
"""The browser parts that these bundles have too."""

PARTS = "parts.js"
"""The bundle of all others, which a page loads when its first picture is there."""

LATER = "later.js"
"""The bundle of what few pages need, and of what a page needs when somebody uses it:
modules that others import by ``import("./x.js")`` only, with what only these import."""

LATER_PARTS = ("features/player/player_bar.js",)
"""The browser parts that this bundle has too."""

PART_FOLDERS = ("console/", "features/")
"""Where the modules of browser parts are, which a page gets from the bundles."""

FIRST_SHEETS = "first_parts.css"
"""The style sheet of the browser parts of :data:`FIRST_PARTS`."""

PART_SHEETS = "parts.css"
"""The style sheet of the browser parts of :data:`PARTS`."""

SHARED_SHEET = "web/style/controls.css"
"""The style sheet that those of features import: it stays a file of its own."""

EAGER = "//# allFunctionsCalledOnLoad\n"
"""The first line of a bundle: Chromium then compiles all its functions at once, beside
the main thread. Else it reads each function twice, the second time when it is called.
"""

_SHEET_FOLDERS = ("features/", "web/tools/")

_IMPORT = re.compile(r'^import (\{[^}]*\}) from "(\.[^"]+)";$', re.M)
_EXPORT = re.compile(
    r"^export (default )?(?=(?:async )?(?:function|class|const) (\w+))", re.M
)
_LATER = re.compile(r'\bimport\("(\.[^"]+)"\)')
_OTHER = re.compile(r"^(?:import|export)\b", re.M)
_COMMENT = re.compile(r"^[ \t]*(?://.*|/\*[^*]*\*+(?:[^/*][^*]*\*+)*/[ \t]*)$", re.M)
_INDENTATION = re.compile(r"(?<=\n)[ \t]+")
_SHEET = re.compile(r'((?:@import url\("[^"]+"\);\s*)*)(.*)', re.S)


def served_modules(
    sources: Mapping[str, str], starts: Sequence[str] = STARTS
) -> dict[str, str]:
    """Return what is served at the address of each module, and the source maps.

    Args:
        sources: The text of each module by name, such as ``"web/page.js"``.
        starts: The bundles that a page loads first.

    Returns:
        Texts by name, also of :data:`PARTS`. The source map of ``x.js`` is
        ``x.js.map``.

    Raises:
        ValueError: If a module has an import or export of another form, imports a
            module that is not there, or the imports form a circle.

    """
    bundles: dict[str, str] = {}  # by module, each module after those that it imports

    def add(name: str, bundle: str, users: tuple[str, ...]) -> None:
        if name in users or name not in sources:
            raise ValueError(
                f"{users[-1]} imports {name}, which is missing or a circle"
            )
        if name not in bundles:
            for address in _imports(name, sources[name]):
                add(_beside(name, address), bundle, (*users, name))
            bundles[name] = bundle

    for bundle in starts:
        for part, owner in FIRST_PARTS.items():
            if owner == bundle:
                add(part, bundle, ())
        add(bundle, bundle, ())
    later = _later(sources)
    needed = _needed(later, sources)
    for name in sources:
        if name not in needed:
            add(name, PARTS, ())
    for name in later:
        add(name, LATER, ())
    texts = {}
    before = ""
    for bundle in (*starts, PARTS, LATER):
        within = {
            one: sources[one] for one, owner in bundles.items() if owner == bundle
        }
        texts[bundle], texts[bundle + ".map"] = _bundle(bundle, within, before)
        before = bundle
    texts[IN_PAGE] = _in_page(texts[starts[0]])
    for name, bundle in bundles.items():
        if name != bundle:
            texts[name] = _import(bundle, name) + _exported(name, sources[name])
    return texts


def _later(sources: Mapping[str, str]) -> list[str]:
    """Return the modules that nobody needs before they are used."""
    found = {name for name in LATER_PARTS if name in sources}
    for name, source in sources.items():
        for address in _LATER.findall(shortened(source)):
            found.add(_beside(name, address))
            if _beside(name, address) not in sources:
                raise ValueError(f"{name} imports {address}, which is missing")
    return sorted(found)


def _needed(names: Sequence[str], sources: Mapping[str, str]) -> set[str]:
    """Return these modules, with all that they import."""
    found: set[str] = set()
    todo = list(names)
    while todo:
        name = todo.pop()
        if name not in found and name in sources:
            found.add(name)
            addresses = _imports(name, sources[name])
            todo += [_beside(name, address) for address in addresses]
    return found


def _bundle(bundle: str, sources: Mapping[str, str], before: str) -> tuple[str, str]:
    """Return the text of a bundle with some modules, and its source map.

    Args:
        bundle: Its name.
        sources: The modules, in the order in which they run.
        before: The bundle before, which must run first; "" for none.

    """
    text = EAGER + "const $modules = (globalThis.$modules ??= {});\n"
    if before:  # the page may have it as a script
        address = _address(before, bundle)
        text += f'if (!$modules["{before}"]) await import("{address}");\n'
    sections = []
    for name, source in sources.items():
        text += f'$modules["{name}"] ??= (() => {{\n'
        # Each line is that line of the source: the same column, the next line.
        origin = {
            "version": 3,
            "sources": [_address(name, bundle)],
            "sourcesContent": [source],
            "names": [],
            "mappings": "AAAA" + ";AACA" * source.count("\n"),
        }
        offset = {"line": text.count("\n"), "column": 0}
        sections.append({"offset": offset, "map": origin})
        text += _statements(name, source) + "})();\n"
    text += "export { $modules };\n"
    if bundle in sources:
        text += _exported(bundle, sources[bundle])
    text += f"//# sourceMappingURL={posixpath.basename(bundle)}.map\n"
    return text, json.dumps({"version": 3, "sections": sections})


def _in_page(text: str) -> str:
    """Return a bundle as a script, not a module, that removes its own element."""
    lines = text.split("\n")
    kept = [line for line in lines if line and not line.startswith(("//", "export "))]
    here = "new URL(document.currentScript.dataset.from, location.href)"
    text = "\n".join(kept).replace("import.meta.url", here)
    return "{\n" + text + "\ndocument.currentScript.remove();\n}\n"


def _imports(name: str, source: str) -> list[str]:
    """Return the addresses that a module imports."""
    addresses = [address for _, address in _IMPORT.findall(source)]
    if len(addresses) + len(_EXPORT.findall(source)) != len(_OTHER.findall(source)):
        raise ValueError(f"{name} has an import or export of another form")
    return addresses


def _statements(name: str, source: str) -> str:
    """Return the body of the function that returns the exports of a module."""

    def imported(found: re.Match[str]) -> str:
        names = found[1].replace(" as ", ": ")
        return f'const {names} = $modules["{_beside(name, found[2])}"];'

    def used(found: re.Match[str]) -> str:
        browser_parts = '$modules["web/browser_parts.js"]'
        return f'{browser_parts}.laterModule("{_beside(name, found[1])}")'

    text = shortened(_EXPORT.sub("", _IMPORT.sub(imported, source)))
    text = _LATER.sub(used, text)
    exports = _EXPORT.findall(source)
    pairs = [f"default: {local}" if default else local for default, local in exports]
    return f"{text}\nreturn {{ {', '.join(pairs)} }};\n"


def _exported(name: str, source: str) -> str:
    """Return the statements that export what is exported by a module of a bundle."""
    exports = _EXPORT.findall(source)
    names = ", ".join(local for default, local in exports if not default)
    text = f'export const {{ {names} }} = $modules["{name}"];\n' if names else ""
    if any(default for default, _ in exports):
        text += f'export default $modules["{name}"].default;\n'
    return text


def _import(bundle: str, name: str) -> str:
    return f'import {{ $modules }} from "{_address(bundle, name)}";\n'


def served_sheets(
    sources: Mapping[str, str], shared: str = SHARED_SHEET
) -> dict[str, str]:
    """Return each style sheet with the sheets that it imports in place of the imports.

    :data:`FIRST_SHEETS` and :data:`PART_SHEETS` are among them.

    Args:
        sources: The text of each sheet by name, such as ``"web/webmap.css"``.
        shared: A sheet that many others import; this import stays, and a browser loads
            the sheet once.

    Raises:
        ValueError: If an import has another form, or comes after rules.
        KeyError: If an import names no sheet.

    """
    mark = "\0"  # where the shared sheet is imported
    within: set[str] = set()  # the sheets that others import

    def rules(name: str) -> str:
        """Return the rules of a sheet and of those that it imports."""
        found = _SHEET.fullmatch(shortened(sources[name]).lstrip())
        if found is None or "@import" in found[2]:
            raise ValueError(f"{name} has an import of another form or after rules")
        needed = [_beside(name, one) for one in re.findall('"(.+)"', found[1])]
        within.update(needed)
        return "".join(mark if n == shared else rules(n) for n in needed) + found[2]

    texts = {name: rules(name) for name in sources}
    first = [name.removesuffix(".js") + ".css" for name in FIRST_PARTS]
    others = [name for name in texts if name.startswith(_SHEET_FOLDERS)]
    for bundle, names in (
        (FIRST_SHEETS, first),
        (PART_SHEETS, [name for name in others if name not in {*first, *within}]),
    ):
        texts[bundle] = "".join(texts.get(name, "") for name in names)
    for name, text in texts.items():
        if mark in text:
            address = _address(shared, name)
            texts[name] = f'@import url("{address}");\n' + text.replace(mark, "")
    return texts


def shortened(text: str) -> str:
    """Return a text without indentation and without comments on lines of their own.

    The lines of comments stay empty. Text in backticks is not changed.
    """
    text = _COMMENT.sub(lambda found: "\n" * found[0].count("\n"), text)
    code, *others = text.split("`")
    parts = [_INDENTATION.sub("", code)]
    for number, part in enumerate(others, 1):
        parts.append(part if number % 2 else _INDENTATION.sub("", part))
    return "`".join(parts)


def _beside(name: str, address: str) -> str:
    """Return the name of what a module or sheet imports from a relative address."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(name), address))


def _address(of: str, seen_from: str) -> str:
    """Return the relative address of a file, as another file imports it."""
    address = posixpath.relpath("/" + of, "/" + posixpath.dirname(seen_from))
    return address if address.startswith(".") else "./" + address
