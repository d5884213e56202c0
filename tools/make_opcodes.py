"""Write the tables that the browser shares with Python, or check them.

``python tools/make_opcodes.py`` writes ``opcodes.js`` and ``motion/state_words.js`` of
``src/webmap/web``; with ``--check`` it only says whether they are what it would write.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from webmap.core.robot_state import WORDS
from webmap.wire.opcodes import TABLES, VERSION

WEB = Path(__file__).parent.parent / "src/webmap/web"

_ABOUT = {
    "OP": "The first byte of each record.",
    "FLAG": "Flags of a frame and of an event that is listened to.",
    "PLACE": "Where a child goes: at the end, at the beginning, after id (place - 2).",
    "VIEW_OPERATIONS": "What a program may do to the view of a map.",
    "SVG_TAGS": "The SVG tags; the numbers of the HTML tags begin after them.",
    "HTML_TAGS": "The HTML tags.",
    "ATTRIBUTES": "The attributes that have a number.",
    "BOOLEAN_ATTRIBUTES": "Attributes that are there or not there.",
    "EVENTS": "The events that an element may listen to.",
}


def opcodes_js() -> str:
    """Return the text of ``opcodes.js``."""
    parts = [
        "// Made by tools/make_opcodes.py from webmap/wire/opcodes.py: do not edit.",
        "/** Changes with the tables, so that a page of another version notices. */\n"
        f"export const VERSION = {VERSION};",
    ]
    for name, table in TABLES.items():
        parts.append(f"/** {_ABOUT[name]} */\nexport const {name} = {_literal(table)};")
    return "\n\n".join(parts) + "\n"


def state_words_js() -> str:
    """Return the text of ``state_words.js``."""
    rows = "".join(f"  {name}: {json.dumps(text)},\n" for name, text in WORDS.items())
    return (
        "// Made by tools/make_opcodes.py from webmap/core/robot_state.py: do not edit."
        "\n"
        "\n"
        "/** What a robot is doing, in words; `{who}` is who holds or drives it. */\n"
        f"export const WORDS = Object.freeze({{\n{rows}}});\n"
    )


FILES = {"opcodes.js": opcodes_js, "motion/state_words.js": state_words_js}


def _literal(table: Any) -> str:
    if isinstance(table, dict):
        rows = "".join(f"  {key}: {value},\n" for key, value in table.items())
        return f"Object.freeze({{\n{rows}}})"
    rows = "".join(f"  {json.dumps(item)},\n" for item in table)
    return f"Object.freeze([\n{rows}])"


def main() -> int:
    """Write or check; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="only check")
    check = parser.parse_args().check
    status = 0
    for name, made in FILES.items():
        target, text = WEB / name, made()
        if not check:
            target.write_text(text, encoding="utf-8")
        elif not target.exists() or target.read_text(encoding="utf-8") != text:
            again = f"run python {Path(__file__).name}"
            print(f"{target} is out of date: {again}", file=sys.stderr)
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
