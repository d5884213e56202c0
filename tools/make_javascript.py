"""Write the tables that the browser shares with Python, or check them.

``python tools/make_javascript.py`` writes the files of ``FILES`` below
``src/webmap/web``; with ``--check`` it only reports which of them are out of date.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from webmap.console.card_parts import GOALS
from webmap.core.robot_state import SEEN, STATE_TEXTS
from webmap.features.goals.goals import SPACING
from webmap.features.routes.route_tool import LONGEST_NAME, MOST_POINTS
from webmap.gate.protocol import MAY_MOVE
from webmap.ros.messages import LOG_LEVELS
from webmap.scene.wire.messages import LONGEST_TEXTS, MOST_UNSEEN, PAGE_ID
from webmap.scene.wire.opcodes import TABLES, VERSION
from webmap.server.access import CODE, KEY, PROTOCOL
from webmap.server.bundles import (
    FIRST_PARTS,
    FIRST_SHEETS,
    LATER,
    LATER_PARTS,
    PART_FOLDERS,
    PART_SHEETS,
    PARTS,
)
from webmap.server.html import FOLDER
from webmap.server.page_socket import BROKEN_RULE, REPLACED

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
        "// Made by tools/make_javascript.py from webmap/scene/wire/opcodes.py: do not "
        "edit.",
        "/** Changes with the tables, so that a page of another version notices. */\n"
        f"export const VERSION = {VERSION};",
    ]
    for name, table in TABLES.items():
        parts.append(f"/** {_ABOUT[name]} */\nexport const {name} = {_literal(table)};")
    return "\n\n".join(parts) + "\n"


def constants_js() -> str:
    """Return the text of ``constants.js``."""
    constants = {
        "FOLDER": (FOLDER, "The path of WebMap's own files and sockets on the server."),
        "PARTS": (PARTS, "The bundle with WebMap's other browser parts."),
        "LATER": (LATER, "The bundle of what is loaded when somebody uses it."),
        "LATER_PARTS": (list(LATER_PARTS), "The browser parts of this bundle."),
        "PART_FOLDERS": (list(PART_FOLDERS), "Where their own modules are."),
        "FIRST_PARTS": (
            FIRST_PARTS,
            "The bundle of each browser part that a page starts with.",
        ),
        "FIRST_SHEETS": (FIRST_SHEETS, "The style sheet of STOP and driving."),
        "PART_SHEETS": (PART_SHEETS, "The style sheet of the other parts."),
        "PROTOCOL": (PROTOCOL, "The subprotocol of both sockets."),
        "CODE": (CODE, "The field of a query that signs in once."),
        "KEY": (KEY, "The element and the header with the secret of a page."),
        "PAGE_ID": (PAGE_ID, "The pattern of the name that a page chooses for itself."),
        "LONGEST_TEXTS": (
            LONGEST_TEXTS,
            "Characters that texts in messages to the server may have.",
        ),
        "MOST_UNSEEN": (
            MOST_UNSEEN,
            "Most elements that a page names because it does not show them.",
        ),
        "FOR_GOOD": (
            [BROKEN_RULE, REPLACED],
            "Close codes after which the page does not connect again.",
        ),
        "MOST_POINTS": (MOST_POINTS, "Most points of a route."),
        "LONGEST_NAME": (LONGEST_NAME, "Most characters of a route's name."),
        "SPACING": (list(SPACING), "Metres between robots that are sent together."),
        "LEVELS": (list(LOG_LEVELS), "The levels of a log, the lowest first."),
        "MAY_MOVE": (MAY_MOVE, "The alarm about a robot that zero cannot reach."),
        "GOALS": (
            {state: [words, shape] for state, (words, shape, _) in GOALS.items()},
            "The text and the shape of each state of a goal.",
        ),
        "WORDS": (
            STATE_TEXTS,
            "The text of each activity and condition of a robot, the worst first; "
            "`{who}` is its operator.",
        ),
        "SEEN": (
            list(SEEN),
            "The activities that the display finds besides the gate's.",
        ),
    }
    parts = ["// Made by tools/make_javascript.py: do not edit."]
    for name, (value, about) in constants.items():
        text = json.dumps(value)
        if isinstance(value, dict):
            rows = (f"  {json.dumps(key)}: {json.dumps(value[key])}," for key in value)
            text = "\n".join(["Object.freeze({", *rows, "})"])
        elif isinstance(value, list):
            text = f"Object.freeze({text})"
            if len(text) > 88:
                text = _literal(value)
        parts.append(f"/** {about} */\nexport const {name} = {text};")
    return "\n\n".join(parts) + "\n"


FILES = {
    "opcodes.js": opcodes_js,
    "constants.js": constants_js,
}


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
