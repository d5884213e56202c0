"""Rules for every file of the project."""

import ast
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from webmap.server.own_files import FOLDERS

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "src").rglob("*.py"))
# A path of a developer's machine: a home folder, a checkout, the folder of root.
MACHINE_PATH = re.compile(
    r"(?<![\w./*])(?:/(?:home|Users)/\w+/|/(?:root|work)/\w|[A-Z]:\\Users\\\w)"
)


def project_files() -> list[Path]:
    """Return the files that git tracks, or all files of src without git (an sdist)."""
    names: list[str] = []
    if (ROOT / ".git").exists() and (git := shutil.which("git")):
        done = subprocess.run(
            [git, "ls-files", "-z"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
        )
        names = done.stdout.split("\0")[:-1]
    files = [ROOT / name for name in names] or list((ROOT / "src").rglob("*"))
    return [path for path in files if path.is_file()]


def test_every_source_file_has_a_module_docstring() -> None:
    silent = [
        str(path.relative_to(ROOT))
        for path in SOURCES
        if not ast.get_docstring(ast.parse(path.read_text("utf-8")))
    ]
    assert not silent


def test_no_file_contains_a_path_of_a_developer_machine() -> None:
    found = []
    for path in project_files():
        try:
            text = path.read_text("utf-8")
        except UnicodeDecodeError:
            continue
        found += [
            f"{path.relative_to(ROOT)}: {match[0]}"
            for match in MACHINE_PATH.finditer(text)
        ]
    assert not found


# In parts, so that this file contains no such path.
@pytest.mark.parametrize("parts", [("/home", "ann", "x"), ("cd /root", "a")])
def test_the_machine_path_pattern_finds_such_paths(parts: tuple[str, ...]) -> None:
    assert MACHINE_PATH.search("/".join(parts))


# Terms of rosbridge only: operations, encodings, fields, nodes and parameters.
ROSBRIDGE_WORDS = re.compile(
    r"rosapi|rosbridge_(?:suite|websocket|server|library)|max_message_size|cbor|"
    r"fragment_size|throttle_rate|advertise_service|service_response|"
    r"[\"'](?:subscribe|unsubscribe|advertise|unadvertise|publish|call_service)[\"']",
    re.IGNORECASE,
)
PROTOCOL_ROOMS = (
    "ros/rosbridge/",
    "ros/foxglove/",
    "ros/rmw_zenoh/",
    "gate/",  # the gate has separate sockets to the rosbridge
    "agents/",  # an agent forwards the requests of displays to its rosbridge
    "testing/",  # the test robots have rosbridges
)
# These messages name rosapi, as users must start it; a replay starts it, too. A setting
# of Zenoh has the name of one of rosbridge.
ROSBRIDGE_TEXTS = {
    "base/zenoh_sessions.py": {"max_message_size"},
    "bags/player.py": {"rosapi"},
    "cli/doctor.py": {"rosapi"},
    "fleet/search.py": {"rosapi"},
    "cli/record.py": {"rosapi"},
    "bags/record.py": {"rosapi"},
    "cli/options.py": {"rosapi"},
    "features/doctor/doctor_panel.py": {"rosapi"},
    "sim/process.py": {"rosapi"},
}


def test_only_the_allowed_folders_use_rosbridge_terms() -> None:
    found = []
    for path in SOURCES:
        name = path.relative_to(ROOT / "src/webmap").as_posix()
        if name.startswith(PROTOCOL_ROOMS):
            continue
        terms = {term.lower() for term in ROSBRIDGE_WORDS.findall(path.read_text())}
        found += [f"{name}: {w}" for w in terms - ROSBRIDGE_TEXTS.get(name, set())]
    assert not found, (
        "write topics, messages and services, as webmap.ros.bridge does; the folder of "
        "another protocol belongs in PROTOCOL_ROOMS"
    )


@pytest.mark.parametrize("text", ['"/rosapi/topics"', "'call_service'", "in CBOR"])
def test_the_rosbridge_pattern_finds_rosbridge_terms(text: str) -> None:
    assert ROSBRIDGE_WORDS.search(text)
    assert not ROSBRIDGE_WORDS.search("bridge.call_service(name)")


IMPORTED = re.compile(
    r"""^(?:import|export|\}) .*?["'](\.[^"']+)["'];$|^@import url\("(.+)"\);$""", re.M
)


def test_every_file_imported_by_a_script_or_style_sheet_is_served():
    package = ROOT / "src" / "webmap"
    served = {
        file.resolve()
        for folder in FOLDERS
        for file in (package / folder).rglob("*")
        if file.suffix in {".css", ".js"}
    }
    imported = {
        (file.parent / (script or style)).resolve()
        for file in served
        for script, style in IMPORTED.findall(file.read_text("utf-8"))
    }
    assert {file.suffix for file in imported} == {".css", ".js"}
    assert imported <= served


def test_a_page_needs_no_character_that_a_common_font_does_not_have() -> None:
    """Every font for texts has the characters of Windows code page 1252."""
    missing = []
    for path in sorted((ROOT / "src").rglob("*")):
        if path.suffix not in {".js", ".css", ".html"}:
            continue
        escaped = path.read_text("utf-8")
        text = re.sub(r"\\u\{?([\da-f]{4,5})\}?", lambda m: chr(int(m[1], 16)), escaped)
        others = {character for character in text if not _is_common(character)}
        missing += [f"{path.relative_to(ROOT)}: {character!r}" for character in others]
    assert not missing


def _is_common(character: str) -> bool:
    try:
        character.encode("cp1252")
    except UnicodeEncodeError:
        return False
    return True
