"""A command that opens the console, and its page in a browser."""

import re
import signal
import subprocess
import sys
from contextlib import contextmanager

from real_browser import Complaints


@contextmanager
def shown(chromium, *arguments):
    """Run a command that opens the console, and open its page."""
    command = [sys.executable, "-m", "webmap", *arguments, "--port", "0"]
    with subprocess.Popen(
        [*command, "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        context, complaints = chromium.new_context(), Complaints()
        try:
            url = re.search(r"ready at (\S+)", process.stdout.readline())[1]
            page = context.new_page()
            complaints.listen(page)
            page.goto(url)
            yield page
        finally:
            context.close()
            process.send_signal(signal.SIGINT)
            process.wait(15)
    assert not complaints.unexpected, complaints.unexpected
