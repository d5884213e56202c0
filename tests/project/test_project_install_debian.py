"""The installation of Debian packages waits for another apt-get."""

import os
import subprocess
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[2] / "tools" / "install_debian.sh"

BUSY = "E: Could not get lock /var/lib/apt/lists/lock. It is held by process 7."
OFFLINE = "E: The list of sources could not be read."

APT_GET = """#!/bin/sh
printf '%s\\n' "$*" >> calls
[ "$1" = update ] || exit 0
[ "$(grep -c update calls)" -gt 2 ] && exit 0
printf '%s\\n' "$MESSAGE" >&2
exit 100
"""
"""Fails twice with a message and then succeeds."""


def install(folder: Path, message: str) -> tuple[int, str, list[str]]:
    """Run the tool as root with another apt-get; return the calls of that one too."""
    for name, text in {
        "apt-get": APT_GET,
        "id": "#!/bin/sh\necho 0\n",
        "sleep": "#!/bin/sh\n",
    }.items():
        program = folder / name
        program.write_text(text, "utf-8")
        program.chmod(0o755)
    done = subprocess.run(
        ["bash", TOOL, "chromium"],
        cwd=folder,
        env=os.environ | {"PATH": f"{folder}:{os.environ['PATH']}", "MESSAGE": message},
        capture_output=True,
        text=True,
    )
    calls = (folder / "calls").read_text("utf-8").splitlines()
    return done.returncode, done.stderr, calls


@pytest.mark.skipif(os.name == "nt", reason="there is no apt-get on Windows")
def test_an_installation_waits_while_another_apt_get_runs(tmp_path: Path) -> None:
    status, _, calls = install(tmp_path, BUSY)
    assert status == 0
    *updates, installed = calls
    assert updates == ["update -qq"] * 3
    assert "DPkg::Lock::Timeout=" in installed
    assert installed.endswith("chromium")


@pytest.mark.skipif(os.name == "nt", reason="there is no apt-get on Windows")
def test_an_installation_fails_at_once_with_any_other_error(tmp_path: Path) -> None:
    status, errors, calls = install(tmp_path, OFFLINE)
    assert (status, calls) == (1, ["update -qq"])
    assert OFFLINE in errors
