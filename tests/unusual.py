"""An environment that is unusual, but in which WebMap and its tests must work."""

import os
from pathlib import Path

NOWHERE = "http://127.0.0.1:9"
"""A proxy that does not answer."""


def unusual(folder: Path) -> dict[str, str]:
    """Return the variables of an unusual environment.

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
