"""The drawings of the console, the examples and played recordings do not change."""

import pytest
from drawn_pictures import CONSOLE, expect_drawn, opened, robots
from fixed_site import LATCHED, site

from equipment.bag_files import Made
from equipment.captured_frames import PLAYER, played
from equipment.processes import BRIDGE, running, serving
from equipment.webmap_process import simulator, webmap

# On a busy machine the pages may show for a long time that links are slow.
pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(600)]

ROBOT = "/robot_0/odom:/robot_0/cmd_vel:/robot_0/base_scan"

DRAINING = ("rect.charge", "width")
"""Batteries of simulated robots lose charge all the time."""

PARTICLES = ".posearray"
"""Particles move every second; the layers of fixed messages include them, too."""


@pytest.fixture(autouse=True)
def own_state(tmp_path, monkeypatch):
    """Use a separate state folder, without the marks of other tests."""
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path / "state"))


SCAN = ".laserscan > .dot[d]"


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_the_demo_matches_the_recorded_drawing(chromium, dialect):
    quiet = ("demo", "--robots", "2", "--quiet", "--port", "0", "--no-browser")
    command = (*quiet, "--dialect", dialect)
    shown = (robots(2), SCAN, ".diagnostics", "#robots .charge", *CONSOLE)
    with webmap(*command) as url, opened(chromium, url, *shown) as page:
        unstable = [DRAINING]
        everything = "body" if dialect == "ros1" else "svg.webmap"
        name = f"demo_{dialect}"
        expect_drawn(page, name, hidden=everything, unstable=unstable)
        page.locator("#robots .row button").first.click()
        page.locator("#card .cameras img").wait_for()
        page.locator(".webmap-layers > summary").click()
        expect_drawn(page, f"{name}_selected", unstable=unstable)


def test_messages_of_real_bridges_match_the_recorded_drawing(chromium):
    with (
        running(*played("ros1"), "--port", 0, pattern=BRIDGE, **PLAYER) as one,
        running(*played("ros2"), "--port", 0, pattern=BRIDGE, **PLAYER) as other,
    ):
        received = ("--robot", f"1@Anna:{ROBOT}", "--robot", f"2@Berta:{ROBOT}")
        options = ("--only-given", "--port", "0", "--no-browser")
        with (
            webmap("view", one.url, other.url, *received, *options) as url,
            opened(chromium, url, robots(2), SCAN) as page,
        ):
            expect_drawn(page, "captured")


SITE = site(0, ros2=False)
SECONDS = 40
PLAYED = {
    "/tf": 5,
    "/anna/odom": 5,
    "/anna/scan": 4,
    "/anna/sonar": 4,
    "/anna/points": 2,
    "/anna/plan": 1,
    "/anna/markers": 1,
    "/anna/move_base/local_costmap/footprint": 1,
}
"""The rate of each topic in the bag in Hz; a latched topic is stored once."""


ON_MAP = """() => {
  const [{ matrix }] = document.querySelector(".robot").transform.baseVal;
  return Math.hypot(matrix.e + 2, matrix.f + 1) < 0.01;
}"""


def test_a_played_bag_matches_the_recorded_drawing(chromium, tmp_path):
    made = Made("ros1")

    def at(moment: float, topic: str) -> tuple:
        type, fields = SITE[topic]
        return topic, type, moment, made.message(type, **stamped(fields, made, moment))

    moments = sorted(
        (step / rate, topic)
        for topic, rate in PLAYED.items()
        for step in range(rate * SECONDS)
    )
    once = [at(0.0, topic) for topic in LATCHED if topic in SITE]
    bag = made.bag(tmp_path / "site", *once, *(at(*each) for each in moments))
    command = ("play", bag, "--loop", "--port", "0", "--no-browser")
    with webmap(*command) as url:
        with opened(chromium, url, robots(1), SCAN) as page:
            page.wait_for_function(ON_MAP)
        # The first view is around the robot, which has its place on the map now.
        with opened(chromium, url, robots(1), SCAN) as page:
            moves = [(".webmap-player-slider", "style")]
            expect_drawn(page, "played", level=[".world"], unstable=moves)


def stamped(message, made: Made, moment: float):
    """Return fields of a message with the time of a bag in each header."""
    if isinstance(message, list):
        return [stamped(each, made, moment) for each in message]
    if not isinstance(message, dict):
        return message
    return {
        key: made.time(moment) if key == "stamp" else stamped(value, made, moment)
        for key, value in message.items()
    }


@pytest.fixture(scope="module")
def several():
    with simulator("--seed", "7") as url:
        yield url


@pytest.fixture
def flat():
    with simulator("--seed", "7", "--flat") as url:
        yield url


@pytest.mark.parametrize(
    ("script", "sim", "shown"),
    [
        ("simple/simple.py", "flat", (SCAN,)),
        ("advanced/advanced.py", "several", (SCAN,)),
        ("module/show_selected.py", "several", ()),
        ("layers/layers.py", "several", (SCAN, ".pointcloud > .band-7[d]")),
    ],
    ids=["simple", "advanced", "module", "layers"],
)
def test_each_example_matches_its_recorded_drawing(
    chromium, tmp_path, request, script, sim, shown
):
    bridge = request.getfixturevalue(sim)
    with (
        serving(script, bridge, tmp_path / "example") as server,
        opened(chromium, server.url, robots(1), *shown) as page,
    ):
        name = script.partition("/")[0]
        expect_drawn(page, f"example_{name}", absent=[PARTICLES])
