"""Print what a process of the tests has around it, and what a page in Chromium has.

Run by a test, in surroundings that differ.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))

from equipment.environment import use_own_environment

OF_PAGE = """() => {
  const width = (family) => {
    const pen = document.createElement("canvas").getContext("2d");
    pen.font = `20px ${family}`;
    return pen.measureText("Robot 0 is stopped: 1.50 m/s").width;
  };
  return {
    widths: ["system-ui", "sans-serif", "serif", "monospace", "Arial"].map(width),
    dark: matchMedia("(prefers-color-scheme: dark)").matches,
    language: navigator.language,
    zone: Intl.DateTimeFormat().resolvedOptions().timeZone,
    number: (1234.5).toLocaleString(),
  };
}"""

CHILD = "import locale, time; print(locale.getencoding(), time.tzname)"


def seen() -> dict[str, object]:
    """Return what differs between machines, after the surroundings are replaced."""
    from equipment.chromium import launched

    home = Path.home()
    with (home / "written").open("w") as written:  # the home folder can be written to
        encoding = written.encoding
    of_machine = {"HOME", "PATH", "TESTS_OUTSIDE", "PYENV_ROOT", "VIRTUAL_ENV"}
    with launched() as browser:
        page = browser.new_page()
        of_page = page.evaluate(OF_PAGE)
    return {
        "variables": {k: v for k, v in os.environ.items() if k not in of_machine},
        "umask": os.umask(0o022),
        "zone": time.tzname,
        "encoding": encoding.lower(),
        "searched": [path for path in sys.path if "other project" in path],
        "child": subprocess.check_output([sys.executable, "-c", CHILD], text=True),
        "page": of_page,
    }


if __name__ == "__main__":
    use_own_environment()
    print(json.dumps(seen()))
