"""The page reports that another program publishes velocities to the robot.

The other program is a second client of the robot's bridge. The gate, the display and
Chromium are real.
"""

import json
import threading

import pytest
from safety_bench import Bench
from websockets.sync.client import connect

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

SHOWN = "nother program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s): /teleop_node"
STATUS = "(document.querySelector('.webmap-teleop-state')?.innerText ?? '')"
ALARM = "(document.querySelector('.webmap-alarm')?.innerText ?? '')"


class OtherProgram:
    """Publishes a velocity at 10 Hz for as long as the ``with`` block lasts."""

    def __init__(self, port):
        self._port = port
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._publish)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *exception):
        self._over.set()
        self._thread.join(10)

    def _publish(self):
        linear, angular = (
            {"x": 0.1, "y": 0.0, "z": 0.0},
            {"x": 0.0, "y": 0.0, "z": -0.2},
        )
        twist = {"linear": linear, "angular": angular}
        message = {"op": "publish", "topic": "/cmd_vel", "msg": twist}
        with connect(f"ws://127.0.0.1:{self._port}", compression=None) as socket:
            while not self._over.wait(0.1):
                socket.send(json.dumps(message))


@pytest.fixture
def bench(tmp_path):
    with Bench(tmp_path, timeout=0.5) as bench:
        nodes = ["/rosbridge_websocket", "/teleop_node"]
        bench.robot._bridge.publishers["/cmd_vel"] = nodes
        bench.open_page()
        yield bench


def is_shown(tab, expression: str, within: float) -> bool:
    """Return whether an expression becomes true in a page."""
    try:
        tab.wait(expression, within)
    except AssertionError:
        return False
    return True


def test_the_page_names_another_program_before_driving_while_driving_and_in_alarm(
    bench,
):
    bench.drive_off()
    bench.let_go()
    bench.tab.wait(f"!{STATUS}.includes('nother program')")
    bench.others_publish = True
    with OtherProgram(bench.robot.port):
        bench.tab.wait(f"{STATUS}.includes({json.dumps(SHOWN)})")
        # If the machine does not run for 0.3 s, the robot does not move for this time,
        # and then the gate considers that the robot has obeyed.
        for within in (5.0, 5.0, 15.0):
            bench.press()
            bench.tab.wait(
                f"{STATUS}.includes('You are driving') && {STATUS}.includes('{SHOWN}')"
            )
            bench.let_go()
            if is_shown(bench.tab, f"{ALARM}.includes('{SHOWN}')", within):
                break
        else:
            raise AssertionError("no alarm")
    bench.tab.wait(f"!{STATUS}.includes('nother program')")
