"""What displays and viewers cost an agent, and the bytes on its uplink.

The agent of five simulated robots, with one display and with several, each a process
with viewers that draw nothing. A relay between agent and router counts the bytes.
"""

import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import psutil

from benchmarks.harness import Comparison, Contender, Figures, compare

ROBOTS = 5
SHAPES = ((1, 1), (4, 1), (1, 20))
"""Displays, and viewers of each."""


class CountingRelay:
    """Passes connections on to a port, and counts the bytes that come from near."""

    def __init__(self, port: int) -> None:
        self.bytes = 0
        self._target = port
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        self._links: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        """End every connection."""
        for link in (self._server, *self._links):
            link.close()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._server.accept()
            except OSError:
                return
            far = socket.create_connection(("127.0.0.1", self._target))
            for link in (near, far):
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._links += [near, far]
            for one, other, counts in ((near, far, True), (far, near, False)):
                threading.Thread(
                    target=self._pass_on, args=(one, other, counts), daemon=True
                ).start()

    def _pass_on(self, one: socket.socket, other: socket.socket, counts: bool) -> None:
        try:
            while data := one.recv(1 << 16):
                self.bytes += len(data) if counts else 0
                other.sendall(data)
        except OSError:
            pass


@contextmanager
def started(*command: object, state: str = "") -> Iterator[tuple[str, psutil.Process]]:
    """Run a command of WebMap; yield the address in its first line, and its process."""
    with subprocess.Popen(
        [sys.executable, "-m", "webmap", *map(str, command)],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | ({"WEBMAP_STATE_DIR": state} if state else {}),
    ) as running:
        try:
            assert running.stdout is not None
            line = running.stdout.readline()
            if " at " not in line:
                raise RuntimeError(f"expected an address, got {line!r}")
            yield line.rpartition(" at ")[2].strip(), psutil.Process(running.pid)
        finally:
            running.terminate()


def used(process: psutil.Process) -> float:
    """Return the seconds of processor time of a process and its children."""
    every = [process, *process.children(recursive=True)]
    return sum(sum(each.cpu_times()[:2]) for each in every)


def watched_by(displays: int, viewers: int, seconds: float) -> Callable[[], Figures]:
    """Return a run with a number of displays, and viewers of each."""

    def run() -> Figures:
        with ExitStack() as running:
            folder = running.enter_context(tempfile.TemporaryDirectory())
            sim = ("sim", "--robots", ROBOTS, "--port", 0, "--no-extras")
            url, _ = running.enter_context(started(*sim))
            router, _ = running.enter_context(
                started("router", "--listen", "tcp/127.0.0.1:0")
            )
            relay = CountingRelay(int(router.rpartition(":")[2]))
            running.callback(relay.close)
            uplink = f"zenoh://127.0.0.1:{relay.port}"
            options = ("--router", uplink, "--name", "bay3")
            _, agent = running.enter_context(
                started("agent", url, *options, state=f"{folder}/agent")
            )
            watching = []
            for number in range(displays):
                view = ("view", router, "--port", 0, "--no-browser")
                page, _ = running.enter_context(
                    started(*view, state=f"{folder}/{number}")
                )
                command = (sys.executable, "-m", "benchmarks.watchers", page)
                watching.append(
                    subprocess.Popen(
                        [*command, str(viewers), str(seconds + 5.0)],
                        stdout=subprocess.PIPE,
                        text=True,
                    )
                )
            for each in watching:
                assert each.stdout is not None
                if each.stdout.readline().strip() != "ready":
                    raise RuntimeError("the viewers saw no frame")
            time.sleep(2.0)
            before, sent = used(agent), relay.bytes
            time.sleep(seconds)
            cpu, sent = used(agent) - before, relay.bytes - sent
            for each in watching:
                assert each.stdout is not None
                json.loads(each.stdout.readline())
                each.wait()
                each.stdout.close()
        return {
            "cpu of the agent (ms a second)": 1000 * cpu / seconds,
            "bytes on the uplink (kB a second)": sent / seconds / 1000,
        }

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare one display and viewer with several."""
    seconds = 2.0 if quick else 10.0
    contenders = [
        Contender(
            f"{displays} displays, {viewers} viewers each",
            watched_by(displays, viewers, seconds),
        )
        for displays, viewers in SHAPES
    ]
    return [compare(f"an agent with {ROBOTS} robots", contenders, rounds)]
