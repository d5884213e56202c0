"""Write docs/reference/layers.md from the declarations of layers.

python tools/make_layers_page.py           write the page
python tools/make_layers_page.py --check   fail if the page is out of date
"""

import ast
import inspect
import sys
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from webmap.modules.declaration import Declaration, TopicKind, declarations
from webmap.modules.layer_options import LayerOptions

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "layers.md"

MARK = "<!-- tools/make_layers_page.py writes everything below. -->"


RULES = """\
Discovery draws a topic by the first row that fits its type and its name.
The names are regular expressions, searched in the whole name of the topic.
The last column is the greatest number of topics of a row for one robot, the best first,
because each topic uses the robot's network."""


def page() -> str:
    """Return the whole page; the part above the mark is unchanged."""
    head = PAGE.read_text("utf-8").partition(MARK)[0]
    layers = [each for each in declarations() if each.built_in]
    rows = ["| layer | draws | switch |", "|---|---|---|"]
    for each in layers:
        cells = (_name(each), _types(each.types), ", ".join(each.switches))
        rows.append(f"| {' | '.join(cells)} |")
    rows += [
        "",
        "(layer-rules)=",
        "## Rules for topics",
        "",
        RULES,
        "",
        "| type | names, the best first | layer, with options | most |",
        "|---|---|---|---|",
    ]
    rows += [_rule(each, kind) for each in layers for kind in each.kinds]
    described = [_described(each) for each in layers if _has_options(each)]
    return "\n".join([f"{head}{MARK}", "", *rows, "", *described])


def _rule(declared: Declaration, kind: TopicKind) -> str:
    names = [
        f"`{pattern}`: {words}" if pattern else words
        for pattern, words in kind.names.items()
    ]
    options = [f"`{key}={value!r}`" for key, value in kind.options.items()]
    cells = (
        _types(kind.types),
        "<br>".join(names).replace("|", "\\|"),
        " ".join([f"`{declared.name}`", *options]),
        str(kind.most),
    )
    return f"| {' | '.join(cells)} |"


def _name(declared: Declaration) -> str:
    if _has_options(declared):
        return f"[`{declared.name}`](#{declared.name.lower()})"
    return f"`{declared.name}`: {{doc}}`modules`"


def _types(types: Iterable[str]) -> str:
    return ", ".join(f"`{type}`" for type in types)


def _has_options(declared: Declaration) -> bool:
    return issubclass(declared.layer, LayerOptions)


def _described(declared: Declaration) -> str:
    layer = declared.layer
    owner = "maps" if declared.of_maps else "robots"
    lines = [f"## {declared.name}", "", f"Layer of {owner}.", ""]
    lines += [_markdown(inspect.getdoc(layer) or ""), ""]
    signature = inspect.signature(layer)
    first = signature.parameters["topic"].default
    usual = "" if first is inspect.Parameter.empty else f", by default `{first}`"
    lines.append(f"The arguments are the bridge and the topic{usual}.")
    by_place = [
        f"`{each.name}`"
        for each in list(signature.parameters.values())[3:]
        if each.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD
    ]
    if by_place:
        listed = ", ".join(by_place)
        lines.append(f"These options may also be positional, in this order: {listed}.")
    lines += ["", "| option | default | meaning |", "|---|---|---|"]
    for each in list(signature.parameters.values())[3:]:
        text = " ".join(option_doc(layer, each.name).split())
        default = f"`{_shown(each.default)}`"
        lines.append(f"| `{each.name}` | {default} | {_markdown(text)} |")
    return "\n".join(lines) + "\n"


def option_doc(layer: type, option: str) -> str:
    """Return the docstring of an option, from the layer's class or a base class."""
    for each in layer.__mro__:
        if option in inspect.get_annotations(each):
            found = _docs_of(each).get(option)
            if found:
                return found
    return ""


def _docs_of(layer: type) -> dict[str, str]:
    (made,) = ast.parse(textwrap.dedent(inspect.getsource(layer))).body
    assert isinstance(made, ast.ClassDef)
    docs = {}
    for one, below in zip(made.body, made.body[1:], strict=False):
        match (one, below):
            case (
                ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(text))),
            ):
                docs[name] = text
    return docs


def _shown(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def _markdown(text: str) -> str:
    return text.replace("``", "`")


def main() -> int:
    """Write the page or check it, and return the exit status."""
    text = page()
    if "--check" not in sys.argv:
        PAGE.write_text(text, "utf-8")
    elif not PAGE.exists() or PAGE.read_text("utf-8") != text:
        print(f"{PAGE} is out of date: run make generated", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
