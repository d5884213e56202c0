"""A crowd that watches, and a processor that is busy, while a person holds W."""

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from safety_bench import TRIALS, pass_time

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

VIEWERS = 50 if TRIALS > 1 else 20
SILENT = 5


@contextlib.contextmanager
def crowd(url):
    script = Path(__file__).with_name("safety_crowd.py")
    command = [sys.executable, str(script), url, str(VIEWERS), str(SILENT)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            yield
            assert process.poll() is None, "the crowd has gone"
        finally:
            process.stdin.close()
            process.wait(20)


@contextlib.contextmanager
def busy_processor():
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as process:
        try:
            yield
        finally:
            process.kill()


def test_a_crowd_and_a_busy_processor_do_not_slow_a_release(bench):
    bench.heal()
    with crowd(bench.url), busy_processor():
        bench.prove(
            f"the key is let go; {VIEWERS} viewers, {SILENT} of them read nothing, "
            "and a busy processor",
            bench.let_go,
            within=0.1,
            held_after=False,
        )


def test_a_crowd_and_a_busy_processor_do_not_slow_the_dead_man(bench):
    def send(sig):
        os.killpg(bench.browser.process.pid, sig)

    def back():
        pass_time(0.5)
        send(signal.SIGCONT)

    bench.heal()
    with crowd(bench.url), busy_processor():
        bench.prove(
            f"the browser is stopped; {VIEWERS} viewers, {SILENT} of them read "
            "nothing, and a busy processor",
            lambda: send(signal.SIGSTOP),
            within=0.3,
            back=back,
        )
