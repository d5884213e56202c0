"""Write the wire's table for the browser, or check that it is up to date.

``python tools/make_opcodes.py`` writes ``src/webmap/web/opcodes.js``; with ``--check``
it only says whether that file is what it would write.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from webmap.wire.opcodes import TABLES, VERSION

TARGET = Path(__file__).parent.parent / "src/webmap/web/opcodes.js"

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
    text = opcodes_js()
    if not parser.parse_args().check:
        TARGET.write_text(text, encoding="utf-8")
        return 0
    if TARGET.exists() and TARGET.read_text(encoding="utf-8") == text:
        return 0
    print(f"{TARGET} is out of date: run python {Path(__file__).name}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
