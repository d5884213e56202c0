"""The environment of the tests: the same on every machine, or an unusual one.

Locale, time zone, home folder, proxies, fonts and the permissions of new files change
what programs do. :func:`use_own_environment` replaces those of the machine, for this
process and for all that it starts. pip alone gets those of the machine, because it
reaches an index with them: see :func:`outside`.
"""

import atexit
import json
import locale
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).parent
FONTS = HERE / "fonts.conf"

KEPT = {
    "CHROMIUM",
    "LD_LIBRARY_PATH",
    "PATH",
    "PYENV_ROOT",
    "PYTHON312",
    "SYSTEMROOT",
    "TEMP",
    "TMP",
    "TMPDIR",
    "VIRTUAL_ENV",
}
"""The variables that say where programs and temporary files are."""

KEPT_PREFIXES = (
    "COV_",
    "COVERAGE_",
    "OPENBLAS_",
    "PYTEST_",
    "WEBMAP_DECISIONS",
    "WEBMAP_DRAWN",
    "WEBMAP_POSES",
    "WEBMAP_SAFETY_",
    "WEBMAP_SCRIPTED",
    "WEBMAP_UPDATE_GOLDEN",
    "WEBMAP_WIRES",
)
"""The beginnings of variables with which somebody asks for something of the tests.

OpenBLAS computes wrong results on some virtual processors without its variables.
"""

_OUTSIDE = "TESTS_OUTSIDE"
"""The variable with the machine's own variables; it also marks what is done."""


def use_own_environment() -> None:
    """Replace the environment of this process; a second call changes nothing."""
    os.umask(0o022)
    if _OUTSIDE in os.environ:  # a process that another process of the tests started
        return
    outside = dict(os.environ)
    home = Path(tempfile.mkdtemp(prefix="webmap-home-"))
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    kept = {
        name: value
        for name, value in outside.items()
        if name in KEPT or name.startswith(KEPT_PREFIXES)
    }
    # pyenv finds the other versions of Python below the home folder.
    if (pyenv := Path.home() / ".pyenv").is_dir():
        kept.setdefault("PYENV_ROOT", str(pyenv))
    searched = outside.get("PYTHONPATH", "").split(os.pathsep)
    sys.path[:] = [path for path in sys.path if not path or path not in searched]
    os.environ.clear()
    os.environ.update(kept)
    os.environ |= {
        "HOME": str(home),
        "LC_ALL": "C.UTF-8",
        "TZ": "UTC",
        "FONTCONFIG_FILE": str(FONTS),
        _OUTSIDE: json.dumps(outside),
    }
    time.tzset()
    locale.setlocale(locale.LC_ALL, "")


def outside() -> dict[str, str]:
    """Return the environment of the machine, for pip and its proxies and caches."""
    return json.loads(os.environ[_OUTSIDE])


NOWHERE = "http://127.0.0.1:9"
"""A proxy that does not answer."""


def unusual_environment(folder: Path) -> dict[str, str]:
    """Return the variables of an unusual environment, in which the tests must pass.

    The locale is German and not UTF-8, the time zone is half an hour off the full
    hours, proxies do not answer, the home folder has a space in its name, is empty and
    cannot be written to, the folders of the desktop do not exist, and Python looks for
    modules in the folder of another project.

    Args:
        folder: A folder for what the environment names.

    """
    home = folder / "a home"
    home.mkdir(mode=0o555)
    other = folder / "other project"
    other.mkdir()
    (other / "other_module.py").write_text("")
    proxies = ("http", "https", "ws", "wss", "all", "HTTP", "HTTPS", "ALL")
    desktop = ("CONFIG", "STATE", "CACHE", "DATA")
    return {
        "PATH": os.environ["PATH"],
        "HOME": str(home),
        "LANG": "de_DE",
        "LC_ALL": "de_DE.ISO-8859-1",
        "LANGUAGE": "de",
        "TZ": "Asia/Kolkata",
        "PYTHONPATH": str(other),
        "GTK_THEME": "Adwaita:dark",
        "FONTCONFIG_FILE": "/etc/fonts/fonts.conf",
        **{
            f"{name}_{'PROXY' if name.isupper() else 'proxy'}": NOWHERE
            for name in proxies
        },
        **{f"XDG_{name}_HOME": "/proc/nowhere" for name in desktop},
        "XDG_RUNTIME_DIR": "/proc/nowhere",
    }
