"""A narrow uplink: data is delayed, but ticks and commands should not be delayed.

Between an agent and its router is a line of 1 Mbit/s, each way, for all sessions of
the agent. A display subscribes to the data of more and more robots. An operator at the
same display has control of a robot and sends a command of speed zero 20 times a second.

The benchmark measures the time from a command to the tick that acknowledges it, which
includes up to 50 ms until the next tick of the gate. It also measures the rate and the
age of the data that arrives.
"""

import asyncio
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack

from benchmarks.agents import Operator
from benchmarks.harness import Comparison, Contender, Figures, compare, percentile
from benchmarks.line import Line, Queue
from benchmarks.plot import Curve, Plot, save
from benchmarks.processes import started
from webmap import Bridge
from webmap.agents.gates import Gates
from webmap.agents.peer import close_peers
from webmap.base.tasks import LoopThread
from webmap.config.motion import TwistConfig
from webmap.core.motion import id_at_agent
from webmap.gate.protocol import RobotSpec
from webmap.ros.messages import LaserScanMsg, OdometryMsg

ROBOTS = 16
WIDTH = 125_000.0
"""Bytes a second: 1 Mbit/s."""

LOADS = (8, 16)
"""Robots whose scans and odometry a display shows."""

PERIOD = 0.05
WARM = 2.0
"""Seconds before the measurement, in which queues may fill."""

TRIP, TRIP_95, TRIP_99 = (f"command to its tick, {n} (ms)" for n in (50, 95, 99))
ANSWERED = "commands with an answer within 300 ms (%)"
RATE, AGE, AGE_95 = "data (messages a second)", "age, 50 (ms)", "age, 95 (ms)"
BYTES = "bytes on the line (kB a second)"


class Arrivals:
    """The ages of the messages that arrive."""

    def __init__(self) -> None:
        self.ages: list[float] = []

    def take(self, message: OdometryMsg | LaserScanMsg) -> None:
        """Record a message; its stamp is from the clock of this computer."""
        self.ages.append(1000 * (time.time() - message.header.stamp.seconds))


def subscribe(url: str, robots: int, arrivals: Arrivals) -> Callable[[], None]:
    """Subscribe to the data of robots; return a function that unsubscribes."""
    thread = LoopThread("data")
    bridge = Bridge(url)

    async def begin() -> None:
        for number in range(robots):
            robot = f"/robot_{number}"
            bridge.subscribe(
                f"{robot}/odom",
                arrivals.take,
                "nav_msgs/Odometry",
                throttle=100,
                decode=OdometryMsg,
            )
            bridge.subscribe(
                f"{robot}/base_scan",
                arrivals.take,
                "sensor_msgs/LaserScan",
                throttle=100,
                decode=LaserScanMsg,
            )
        bridge.start(asyncio.get_running_loop())

    thread.call(begin())

    def end() -> None:
        thread.call(bridge.stop())
        thread.end()

    return end


def under_load(
    rate: float | None, queue: Queue, robots: int, seconds: float
) -> Callable[[], Figures]:
    """Return a run over a line with the data of a number of robots."""

    def run() -> Figures:
        with ExitStack() as running:
            state = running.enter_context(tempfile.TemporaryDirectory())
            sim = ("sim", "--robots", ROBOTS, "--port", 0, "--no-extras")
            url, _ = running.enter_context(started(*sim))
            router, _ = running.enter_context(
                started("router", "--listen", "tcp/127.0.0.1:0")
            )
            port = int(router.rpartition(":")[2])
            line = running.enter_context(Line(port, rate, queue))
            uplink = f"zenoh://127.0.0.1:{line.port}"
            options = ("--router", uplink, "--name", "bay3")
            running.enter_context(started("agent", url, *options, state=state))
            return measured(f"{router}/bay3", line, robots, seconds)

    return run


def measured(agent: str, line: Line, robots: int, seconds: float) -> Figures:
    """Return the figures of an operator and the data of some robots."""
    robot = id_at_agent("bay3", "robot_0")
    gates, arrivals = Gates(), Arrivals()
    gates.start()
    try:
        twist = TwistConfig(topic="/cmd_vel", bridge=agent)
        gates.declare(RobotSpec(id=robot, name="robot_0", twist=twist))
        operator = Operator(gates, robot)
        if not operator.armable.wait(30):
            raise RuntimeError("the robot cannot be driven")
        operator.take()
        end_data = subscribe(agent, robots, arrivals)
        try:
            hold(operator, WARM)
            operator.forget()
            arrivals.ages.clear()
            sent, begun = line.up.bytes, time.monotonic()
            hold(operator, seconds)
            took = time.monotonic() - begun
            carried, ages = (line.up.bytes - sent) / took, list(arrivals.ages)
            time.sleep(1.0)  # for the last answers
        finally:
            end_data()
    finally:
        gates.stop()
        close_peers()
    trips = operator.trips
    return {
        TRIP: percentile(trips, 50),
        TRIP_95: percentile(trips, 95),
        TRIP_99: percentile(trips, 99),
        ANSWERED: 100 * sum(trip <= 300 for trip in trips) / max(1, operator.sent),
        RATE: len(ages) / took,
        AGE: percentile(ages, 50),
        AGE_95: percentile(ages, 95),
        BYTES: carried / 1000,
    }


def hold(operator: Operator, seconds: float) -> None:
    """Send commands for a time; take control again whenever it is lost."""
    end = time.monotonic() + seconds
    taken = float("-inf")
    while (now := time.monotonic()) < end:
        if operator.holds:
            operator.drive(0.0)
        elif now - taken > 0.5:
            taken = now
            operator.take()
        time.sleep(PERIOD)


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare a wide line with a narrow one, at each load."""
    seconds = 3.0
    comparisons = []
    for robots in LOADS[-1:] if quick else LOADS:
        contenders = [
            Contender("wide", under_load(None, "fair", robots, seconds)),
            Contender("1 Mbit/s, fair", under_load(WIDTH, "fair", robots, seconds)),
            Contender("1 Mbit/s, one queue", under_load(WIDTH, "one", robots, seconds)),
        ]
        title = f"the data of {robots} robots over the uplink"
        comparisons.append(compare(title, contenders, rounds))
    save("narrow", plot(comparisons))
    return comparisons


def plot(comparisons: Sequence[Comparison]) -> Plot:
    """Return a plot of the delay of ticks against the offered load."""
    loads = [100 * 1000 * each.median("wide", BYTES) / WIDTH for each in comparisons]
    curves = []
    for name in list(comparisons[0].runs)[1:]:
        values = [each.median(name, TRIP_95) for each in comparisons]
        curves.append(Curve(name, list(zip(loads, values, strict=True))))
    title = "From a command to its tick, 95 %, while data crosses the same line"
    return Plot(title, "offered data (% of 1 Mbit/s)", "ms", curves)
