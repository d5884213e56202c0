"""Start WebMap and its simulator as separate processes, as a user does."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

TESTS = str(Path(__file__).parents[1])


@contextmanager
def webmap(*arguments: str | Path, **environment: str) -> Iterator[str]:
    """Run the command ``webmap``; yield the address that it prints when ready.

    Python searches a given ``PYTHONPATH`` before the folder of the tests and before the
    paths of this process.
    """
    if "PYTHONPATH" in environment:
        paths = [environment["PYTHONPATH"], TESTS, os.getenv("PYTHONPATH")]
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
    with subprocess.Popen(
        [sys.executable, "-m", "webmap", *arguments],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    ) as process:
        try:
            line = process.stdout.readline()
            found = re.search(r"ready at (\S+)", line)
            assert found, line
            yield found[1]
        finally:
            process.terminate()
            process.wait(60)  # the machine may be busy


def page_of(file: str | Path, **environment: str) -> AbstractContextManager[str]:
    """Serve a page function or a fleet file; yield the address."""
    return webmap("run", file, "--port", "0", "--no-browser", **environment)


def simulator(*options: str) -> AbstractContextManager[str]:
    """Run simulated robots; yield the address of their rosbridge."""
    return webmap("sim", "--port", "0", *options)
