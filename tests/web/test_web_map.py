"""Maps on a page, in a real Chromium."""

import math

import pytest

from equipment.scene_host import wait
from equipment.waiting import wait_for
from webmap.scene.wire.messages import ModuleMessage, ModuleReady, Trouble, ViewReport

pytestmark = pytest.mark.browser

MAP = "(await import('/_webmap/web/page.js')).page.scene.maps[0]"


def on_map(tab, body):
    """Run ``body`` in the page, where ``map`` is the map; return the result."""
    script = "async () => { const map = %s; %s }"
    return tab.evaluate(script % (MAP, body))


def view(tab):
    return [round(n, 6) for n in on_map(tab, "return Object.values(map.view)")]


def shown_matrix(tab):
    return tab.evaluate(
        """() => {
          const [{ matrix: m }] = document.querySelector(".world").transform.baseVal;
          return [m.a, m.b, m.c, m.d, m.e, m.f];
        }"""
    )


@pytest.fixture
def open_map(host, tab):
    """Open a page with one map and a robot; the function takes the map's size."""

    def open_map(width=0, height=0, build=lambda shown: None):
        def build_map(shown):
            shown.root, shown.world, shown.mount = shown.add_map(width, height)
            shown.robot, shown.inner = shown.add_robot(shown.world, shown.mount)
            build(shown)

        host.build = build_map
        tab.goto(host.url)
        tab.wait_for_selector(".robot circle")
        return host.one

    return open_map


def last_report(host, tab, true=lambda report: True):
    def found():
        reports = host.events(ViewReport)
        return reports and true(reports[-1]) and reports[-1]

    return wait_for(found, page=tab)


def test_a_new_map_has_the_world_origin_in_its_centre(host, tab, open_map):
    shown = open_map(width=640, height=480)
    assert view(tab) == [1, 0, 0, -1, 320, 240]
    assert shown_matrix(tab) == [1, 0, 0, -1, 320, 240]
    report = last_report(host, tab)
    assert report.map_element == shown.root.id
    assert (report.a, report.d, report.e, report.f) == (1, -1, 320, 240)
    assert (report.width, report.height) == (640, 480)
    assert (report.left, report.top) == (10, 5)


def test_a_map_without_a_size_fills_its_container(host, tab, open_map):
    open_map()
    assert view(tab) == [1, 0, 0, -1, 350, 250]
    report = last_report(host, tab)
    assert (report.width, report.height) == (700, 500)


def test_view_operations_are_applied_in_order(host, tab, open_map):
    def build(shown):
        shown.session.view(shown.root.id, "scale", 500 / 58.7, 350, 250)
        shown.session.view(shown.root.id, "translate", 10, 20)
        shown.session.view(shown.root.id, "rotate", 90, 0, 0)

    open_map(build=build)
    factor = 500 / 58.7
    # Counter-clockwise: the point (360, 270) is now at (270, -360).
    expected = pytest.approx([0, -factor, -factor, 0, 270, -360], abs=1e-5)
    wait(tab, "document.querySelector('.world').transform.baseVal[0].matrix.f < 0")
    assert view(tab) == expected
    report = last_report(host, tab, lambda report: report.applied == 3)
    got = [getattr(report, name) for name in "abcdef"]
    assert got == expected


def test_scale_and_rotate_without_a_point_use_the_centre_of_the_map(
    host, tab, open_map
):
    shown = open_map()
    host.call(shown.session.view, shown.root.id, "scale", 4)
    host.call(shown.session.view, shown.root.id, "rotate", 180)
    last_report(host, tab, lambda report: report.applied == 2)
    assert view(tab) == pytest.approx([-4, 0, 0, 4, 350, 250], abs=1e-5)


def test_fit_shows_the_whole_rectangle_of_the_world(host, tab, open_map):
    shown = open_map()
    host.call(shown.session.view, shown.root.id, "fit", -10, -10, 30, 10)
    last_report(host, tab, lambda report: report.applied == 1)
    corner = on_map(tab, "return map.toScreen(-10, 10)")
    other = on_map(tab, "return map.toScreen(30, -10)")
    assert corner["x"] == pytest.approx(24)
    assert other["x"] == pytest.approx(676)
    assert (corner["y"] + other["y"]) / 2 == pytest.approx(250)


def test_set_replaces_the_view(host, tab, open_map):
    shown = open_map()
    host.call(shown.session.view, shown.root.id, "set", 2, 0, 0, -2, 11, 12)
    last_report(host, tab, lambda report: report.applied == 1)
    assert view(tab) == [2, 0, 0, -2, 11, 12]


def test_the_map_shows_the_same_at_the_same_place_when_its_size_changes(
    host, tab, open_map
):
    open_map()
    on_map(tab, "map.setView({ a: 8, b: 2, c: 2, d: -8, e: 40, f: 50 })")
    before = on_map(tab, "return map.toWorld(0, 0)")
    tab.evaluate("document.querySelector('#map').style.width = '411px'")
    report = last_report(host, tab, lambda report: report.width == 411)
    assert on_map(tab, "return map.toWorld(0, 0)") == pytest.approx(before)
    assert report.height == 500


def test_a_fit_of_a_hidden_map_is_applied_when_the_map_is_shown(host, tab, open_map):
    def build(shown):
        shown.document.bind("map").set(hidden=True)
        shown.session.view(shown.root.id, "fit", 0, 0, 10, 10)

    host.build = None

    def build_map(shown):
        shown.root, shown.world, shown.mount = shown.add_map()
        build(shown)

    host.build = build_map
    tab.goto(host.url)
    wait_for(lambda: host.shown and host.one.frames, page=tab)
    host.call(lambda: host.one.document.bind("map").unset("hidden"))
    last_report(host, tab, lambda report: report.width == 700)
    middle = on_map(tab, "return map.toWorld(350, 250)")
    assert (middle["x"], middle["y"]) == pytest.approx((5, 5))


def test_a_followed_robot_keeps_its_place_on_the_screen_until_the_view_is_moved(
    host, tab, open_map
):
    shown = open_map()
    host.call(shown.session.view, shown.root.id, "scale", 10)
    host.call(shown.session.view, shown.root.id, "follow", shown.robot.id)
    last_report(host, tab, lambda report: report.follow == shown.robot.id)
    host.call(shown.robot.set_pose, 3, 4, 1)
    report = last_report(host, tab, lambda report: abs(report.e - 320) < 0.1)
    assert report.f == pytest.approx(290, abs=0.1)
    # A zoom keeps following the robot; moving the view ends the following.
    on_map(tab, "map.setView({ ...map.view, a: 20, d: -20 })")
    assert on_map(tab, "return map.following") == shown.robot.id
    place = on_map(tab, "return map.toScreen(3, 4)")
    host.call(shown.robot.set_pose, 5, 4, 1)
    last_report(host, tab, lambda report: abs(report.e - 280) < 0.1)
    assert on_map(tab, "return map.toScreen(5, 4)") == pytest.approx(place, abs=0.1)
    on_map(tab, "map.setView({ ...map.view, e: map.view.e + 5 })")
    assert on_map(tab, "return map.following") == 0
    last_report(host, tab, lambda report: report.follow == 0)


def test_a_drag_sends_at_most_ten_view_reports_per_second(host, tab, open_map):
    open_map()
    tab.wait_for_timeout(150)
    before = len(host.events(ViewReport))
    took = on_map(
        tab,
        """
        const began = performance.now();
        for (let i = 0; i < 60; i++) {
          map.setView({ ...map.view, e: map.view.e + 1 });
          await new Promise(requestAnimationFrame);
        }
        return (performance.now() - began) / 1000;""",
    )
    last_report(host, tab, lambda report: report.e == 410)
    assert len(host.events(ViewReport)) - before <= 10 * took + 4


def test_an_invalid_view_is_ignored(host, tab, open_map):
    shown = open_map()
    on_map(tab, "map.setView({ ...map.view, e: NaN })")
    on_map(tab, "map.setView({ a: 0, b: 0, c: 0, d: 0, e: 0, f: 0 })")
    host.call(shown.session.view, shown.root.id, "set", 0, 0, 0, 0, 0, 0)
    last_report(host, tab, lambda report: report.applied == 1)
    assert view(tab) == [1, 0, 0, -1, 350, 250]


def test_suppress_next_click_discards_one_click(host, tab, open_map):
    shown = open_map(build=lambda shown: shown.root.on("click", print))
    on_map(
        tab,
        """
        const { signal } = (window.once = new AbortController());
        const end = () => map.suppressNextClick();
        map.svg.addEventListener("pointerup", end, { signal });""",
    )
    tab.mouse.click(100, 100)
    tab.evaluate("window.once.abort()")
    tab.mouse.click(200, 200)
    clicks = wait_for(
        lambda: [e for e in shown.events if hasattr(e, "event")], page=tab
    )
    assert [click.x for click in clicks] == [190]


def test_a_module_receives_the_selected_robot(host, tab, open_map):
    def build(shown):
        shown.session.attach(shown.root.id, 5, "test.js", {"speed": 2}, "half.css")

    shown = open_map(build=build)
    (ready,) = wait_for(lambda: host.events(ModuleReady), page=tab)
    assert ready.instance == 5
    (first,) = host.events(ModuleMessage)
    assert first.data == {"options": {"speed": 2}, "selected": None, "width": 700}
    host.call(shown.session.set_class, shown.inner, "selected", True)
    wait_for(
        lambda: host.events(ModuleMessage)[-1].data == {"selected": "r1"}, page=tab
    )
    host.call(shown.session.unmount, shown.inner)
    wait_for(
        lambda: host.events(ModuleMessage)[-1].data == {"selected": None}, page=tab
    )
    color = "getComputedStyle(document.querySelector('.overlay > .half')).fill"
    wait(tab, f"{color} === 'rgb(255, 0, 0)'")
    assert on_map(tab, "return typeof map.drive.on") == "function"


def test_a_module_receives_messages_sent_before_its_script_was_loaded(
    host, tab, open_map
):
    def build(shown):
        shown.session.attach(shown.root.id, 5, "test.js", {})
        shown.session.send(5, {"n": 1})
        shown.session.send(5, {"n": 2})

    shown = open_map(build=build)
    host.call(shown.session.send, 5, {"n": 3})

    def echoes():
        data = [message.data for message in host.events(ModuleMessage)]
        return [one["echo"]["n"] for one in data if "echo" in one]

    wait_for(lambda: echoes() == [1, 2, 3], page=tab)
    host.call(shown.session.send, 5, {"fail": True})
    tab.wait_for_selector("[role=alert]:has-text('as asked')")
    tab.click("[role=alert] button[aria-label=Dismiss]")
    tab.wait_for_selector("[role=alert]", state="detached")


def test_a_detached_module_removes_its_elements(host, tab, open_map):
    shown = open_map(
        build=lambda shown: shown.session.attach(shown.root.id, 5, "test.js", {})
    )
    tab.wait_for_selector(".half", state="attached")
    host.call(shown.session.detach, 5)
    tab.wait_for_selector(".half", state="detached")


def test_a_module_is_detached_when_its_map_is_removed(host, tab, open_map):
    shown = open_map(
        build=lambda shown: shown.session.attach(shown.root.id, 5, "test.js", {})
    )
    tab.wait_for_selector(".half", state="attached")
    host.call(shown.session.unmount, shown.mount)
    tab.wait_for_selector("svg", state="detached")
    attached = (
        "import('/_webmap/web/page.js').then(({ page }) => page.parts._attached.size)"
    )
    wait_for(lambda: tab.evaluate(attached) == 0, page=tab)


@pytest.mark.parametrize(
    ("module", "message"),
    [
        ("broken.js", "broken.js failed"),
        ("absent.js", "absent.js failed"),
        ("https://evil.example/x.js", "on another server"),
    ],
)
def test_a_module_that_cannot_be_loaded_is_shown_and_reported(
    host, tab, open_map, module, message
):
    tab.allowed = ["404"]
    open_map(build=lambda shown: shown.session.attach(shown.root.id, 5, module, {}))
    tab.wait_for_selector(f"[role=alert]:has-text('{message}')")
    wait_for(lambda: message in str(host.events(Trouble)), page=tab)
    assert tab.locator(".robot").count() == 1


def test_fit_keeps_the_rotation_of_the_view(host, tab, open_map):
    shown = open_map()
    host.call(shown.session.view, shown.root.id, "rotate", 30)
    host.call(shown.session.view, shown.root.id, "fit", 0, 0, 10, 10)
    report = last_report(host, tab, lambda report: report.applied == 2)
    assert math.degrees(math.atan2(-report.b, report.a)) == pytest.approx(30)
