"""Latency from a robot's socket to the attribute in Chromium, and from a key back.

Robot, rosbridge and clock are in this process. The page reports over a separate socket
that it has set a transform or received a key. The time of a report is its arrival here,
so the time of a pose includes one hop too many, and the time of a key lacks one hop.
The reference is a bare relay with the same hops: browser, WebSocket, server in Python,
WebSocket and rosbridge. A key passes through two processes of WebMap, the display and
the gate, so its reference is two bare relays in a row.
"""

import random
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from playwright.sync_api import Page
from websockets.asyncio.server import ServerConnection, serve

from benchmarks.display import BRIDGED, running
from benchmarks.drawing import browser_page
from benchmarks.frames import odometry
from benchmarks.harness import Comparison, Contender, Figures, compare, percentile
from benchmarks.processes import module
from benchmarks.stamped import Y, topics
from webmap.base.tasks import LoopThread
from webmap.testing import WitnessRobot

POSES = 100
KEYS = 25

PAUSE = 0.06
"""The least time between two poses, in seconds."""

FIRST = 20.0
"""x of the first pose, in metres; each next pose is one centimetre farther."""

PATIENCE = 30.0
"""Seconds after which the key must drive the robot."""

REPORT = """(() => {
  const marks = new WebSocket("ws://127.0.0.1:PORT");
  const mark = (text) => marks.readyState === 1 && marks.send(text);
  const { setMatrix } = SVGTransform.prototype;
  SVGTransform.prototype.setMatrix = function (matrix) {
    setMatrix.call(this, matrix);
    mark(`x ${matrix.e}`);
  };
  addEventListener("keydown", ({ repeat }) => repeat || mark("key"), { capture: true });
})();"""


class Robot(WitnessRobot):
    """The robot, with the topics that the pages use."""

    ODOMETRY_TOPIC, TWIST_TOPIC, _ = topics(0)


class Marks:
    """The reports of the page, with their times of arrival."""

    def __init__(self) -> None:
        self.found: list[tuple[float, str]] = []
        self._thread = LoopThread("marks")
        self.port = self._thread.call(self._listen())

    async def _listen(self) -> int:
        server = await serve(self._take, "127.0.0.1", 0, compression=None)
        port: int = next(iter(server.sockets)).getsockname()[1]
        return port

    async def _take(self, link: ServerConnection) -> None:
        async for text in link:
            self.found.append((time.monotonic(), str(text)))

    def end(self) -> None:
        """Stop listening."""
        self._thread.end()


def pose(x: float) -> dict[str, object]:
    """Return an odometry message with a position."""
    message = odometry(0)
    message["pose"]["pose"]["position"] = {"x": x, "y": Y, "z": 0.0}
    return message


def poses(page: Page, robot: WitnessRobot, marks: Marks) -> list[float]:
    """Return the times from a robot's socket to the attribute, in ms."""
    del page
    robot.sends_telemetry = False
    time.sleep(0.5)
    marks.found.clear()
    sent = {}
    for number in range(POSES):
        time.sleep(PAUSE + random.uniform(0.0, 0.05))
        sent[number] = time.monotonic()
        robot.publish(robot.ODOMETRY_TOPIC, pose(FIRST + number / 100))
    time.sleep(0.5)
    seen: dict[int, float] = {}
    for at, text in marks.found:
        if text.startswith("x "):
            seen.setdefault(round((float(text[2:]) - FIRST) * 100), at)
    return [1000 * (seen[n] - at) for n, at in sent.items() if n in seen]


def keys(page: Page, robot: WitnessRobot, marks: Marks) -> list[float]:
    """Return the times from a key to the velocity at the robot's socket, in ms."""
    found = []
    deadline = time.monotonic() + PATIENCE
    while not _pressed(page, robot, marks, 2.0):  # the first press takes control
        if time.monotonic() > deadline:
            raise RuntimeError("the key does not drive the robot")
    for _ in range(KEYS):
        delay = _pressed(page, robot, marks, 1.0)
        if delay is not None:
            found.append(delay)
    return found


def _pressed(
    page: Page, robot: WitnessRobot, marks: Marks, patience: float
) -> float | None:
    """Press the key until the robot gets a velocity; return the time in ms."""
    page.wait_for_timeout(350 + random.uniform(0, 100))
    marks.found.clear()
    begun = time.monotonic()
    page.keyboard.down("w")
    while not (moving := robot.log.moving_since(begun)):
        if time.monotonic() > begun + patience:
            break
        page.wait_for_timeout(5)
    page.keyboard.up("w")
    pressed = [at for at, text in marks.found if text == "key"]
    return 1000 * (moving[0].at - pressed[0]) if moving and pressed else None


def socket_of(url: str) -> str:
    """Return the address of a relay's WebSocket from the address of its page."""
    return url.replace("http", "ws", 1) + "socket"


Measure = Callable[[Page, WitnessRobot, Marks], list[float]]


@contextmanager
def relayed(bridge: str) -> Iterator[str]:
    """Run a relay to a rosbridge or to another relay; yield the address of its page."""
    with module("benchmarks.relay", bridge) as (url, _):
        yield url


def bare(measure: Measure, relays: int = 1) -> Callable[[], Figures]:
    """Return a run of bare relays in a row."""

    def run() -> Figures:
        with ExitStack() as running:
            robot = running.enter_context(Robot())
            bridge = robot.url
            for _ in range(relays):
                url = running.enter_context(relayed(bridge))
                bridge = socket_of(url)
            return measured(url, robot, measure)

    return run


def webmap(measure: Measure) -> Callable[[], Figures]:
    """Return a run of a display and its gate."""

    def run() -> Figures:
        with (
            Robot() as robot,
            running(BRIDGED, BRIDGED_URL=robot.url, BRIDGED_ROBOTS="1") as shown,
        ):
            return measured(shown.url, robot, measure)

    return run


def measured(url: str, robot: WitnessRobot, measure: Measure) -> Figures:
    """Open a page in Chromium and return the figures."""
    with ExitStack() as opened:
        marks = Marks()
        opened.callback(marks.end)
        page = opened.enter_context(browser_page(bypass_csp=True))
        page.add_init_script(REPORT.replace("PORT", str(marks.port)))
        page.goto(url)
        page.locator(".robot.selected:not(.unplaced)").wait_for(state="attached")
        found = measure(page, robot, marks)
    if len(found) < 10:
        raise RuntimeError(f"only {len(found)} were measured")
    return {
        "time, 50 % (ms)": statistics.median(found),
        "time, 99 % (ms)": percentile(found, 99),
        "measured": len(found),
    }


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare both directions with a bare relay."""
    shown = [
        Contender("bare relay", bare(poses)),
        Contender("WebMap", webmap(poses)),
    ]
    driven = [
        Contender("two bare relays", bare(keys, relays=2)),
        Contender("WebMap", webmap(keys)),
    ]
    del quick  # fewer values would give no percentiles
    return [
        compare("from a robot's socket to the attribute in Chromium", shown, rounds),
        compare("from a key in Chromium to the robot's socket", driven, rounds),
    ]
