"""Many robots on a map in a real Chromium: drawn together when small, else singly."""

import struct

import pytest

from equipment.scene_host import wait
from equipment.waiting import wait_for
from webmap.scene import svg
from webmap.scene.node import Fragment
from webmap.scene.wire.messages import ElementEvent

pytestmark = pytest.mark.browser

MANY = 120
ROW = 20
SMALL = 4.0
"""Pixels per metre at which the robots are small: 4 pixels, 10 from each other."""

COUNT = """() => {
  globalThis.writes = { attribute: 0, transform: 0 };
  for (const [of, name, kind] of [
    [Element, "setAttribute", "attribute"],
    [Element, "removeAttribute", "attribute"],
    [DOMTokenList, "toggle", "attribute"],
    [SVGTransform, "setMatrix", "transform"],
  ]) {
    const real = of.prototype[name];
    of.prototype[name] = function (...args) {
      writes[kind]++;
      return real.apply(this, args);
    };
  }
}"""
"""Counts the writes of a page to its document."""

FAR = "document.querySelectorAll('.robots > .far').length"
PATHS = "document.querySelectorAll('.far-robots > path').length"
DRAWN = "document.querySelectorAll('.robots > .robot').length"


RESTYLE = """async (text) => {
  globalThis.sheet ??= new CSSStyleSheet();
  sheet.replaceSync(text);
  document.adoptedStyleSheets = [sheet];
  const { page } = await import("/_webmap/web/page.js");
  page.scene.restyle();
}"""


class Fleet:
    """Robots in rows, 2.5 m from each other and around the world's origin."""

    def __init__(self, shown, count=MANY, scale=SMALL, model=None):
        self.shown = shown
        self.root, self.world, mount = shown.add_map()
        group = Fragment(svg.g(class_="robots"))
        inside = shown.session.mount(group, under=self.world.id, within=mount)
        self.robots = []
        self.mounts = []
        for number in range(count):
            shape = model() if model else svg.circle(r=0.5)
            name = f"r{number}"
            robot = svg.g(svg.title(name), shape, class_="robot", data_robot=name)
            self.mounts.append(
                shown.session.mount(
                    Fragment(robot), under=group.root.id, within=inside, order=0.0
                )
            )
            self.robots.append(robot)
        self.place()
        shown.session.view(self.root.id, "scale", scale)

    def place(self, shift=0.0):
        for number, robot in enumerate(self.robots):
            x, y = number % ROW - ROW / 2, number // ROW - 3.0
            robot.set_pose(2.5 * x + shift, 2.5 * y, shift)


def opened(host, tab, **fleet):
    def build(shown):
        shown.fleet = Fleet(shown, **fleet)

    host.build = build
    tab.goto(host.url)
    wait(tab, f"{DRAWN} === {fleet.get('count', MANY)}")
    return host.one.fleet


def moved(host, tab, fleet, times=5):
    """Move all robots, frame by frame; return the writes of each frame."""
    tab.evaluate(COUNT)
    before = tab.evaluate("({ ...globalThis.writes })")
    for number in range(times):
        frames = host.one.frames
        host.call(fleet.place, 0.1 * (number + 1))
        wait_for(lambda before=frames: host.one.frames > before, page=tab)
        tab.evaluate(
            "new Promise((done) => requestAnimationFrame(() => setTimeout(done)))"
        )
    after = tab.evaluate("({ ...globalThis.writes })")
    return {kind: (after[kind] - before[kind]) / times for kind in after}


def test_many_small_robots_are_one_path_for_each_look(host, tab):
    fleet = opened(host, tab)
    wait(tab, f"{FAR} === {MANY} && {PATHS} === 1")
    fill = "document.querySelector('.far-robots > path').getAttribute('fill')"
    assert tab.evaluate(fill) == "rgb(0, 0, 0)"
    host.call(fleet.robots[0].set, data_state="stopped")
    host.call(fleet.robots[1].set, fill="red")
    wait(tab, f"{PATHS} === 3")
    path = tab.locator(".far-robots > [data-state=stopped]")
    assert path.get_attribute("aria-label") == "1 robots, stopped"
    assert tab.locator(".far-robots > [fill='rgb(255, 0, 0)']").count() == 1
    box = tab.locator(".far-robots > [data-state=stopped]").bounding_box()
    assert box["x"] + box["width"] / 2 == pytest.approx(10 + 350 - 100, abs=1)
    assert box["y"] + box["height"] / 2 == pytest.approx(5 + 250 + 30, abs=1)
    assert box["width"] == pytest.approx(6, abs=1)


def test_a_frame_of_many_small_robots_writes_one_attribute_for_each_look(host, tab):
    fleet = opened(host, tab)
    wait(tab, f"{FAR} === {MANY} && {PATHS} === 1")
    writes = moved(host, tab, fleet)
    assert writes["transform"] == 0
    assert 0 < writes["attribute"] <= 1


def test_robots_outside_the_map_are_written_when_they_come_into_view(host, tab):
    fleet = opened(host, tab, scale=40)  # large, most of them outside
    wait(tab, f"{PATHS} === 0 && {FAR} === 0")
    host.call(host.one.session.view, fleet.root.id, "translate", 5000, 0)
    tab.wait_for_timeout(300)
    writes = moved(host, tab, fleet)
    assert writes == {"attribute": 0, "transform": 0}
    host.call(host.one.session.view, fleet.root.id, "translate", -5000, 0)
    place = "document.querySelector('[data-robot=r70]').transform.baseVal[0].matrix.e"
    wait(tab, f"Math.abs({place} - 0.5) < 0.001")


def test_few_robots_and_large_robots_are_drawn_one_by_one(host, tab):
    fleet = opened(host, tab, count=100)
    tab.wait_for_timeout(300)
    assert tab.evaluate(f"[{FAR}, {PATHS}]") == [0, 0]
    writes = moved(host, tab, fleet)
    assert writes["transform"] == pytest.approx(100, abs=20)


def test_robots_are_drawn_one_by_one_again_from_12_pixels_on(host, tab):
    fleet = opened(host, tab)
    wait(tab, f"{FAR} === {MANY}")
    host.call(host.one.session.view, fleet.root.id, "scale", 4)
    wait(tab, f"{FAR} === 0 && {PATHS} === 0")
    place = "document.querySelector('[data-robot=r70]').transform.baseVal[0].matrix.e"
    assert tab.evaluate(place) == pytest.approx(0.0)


def test_selected_robots_and_robots_with_something_large_stay_themselves(host, tab):
    fleet = opened(host, tab)
    wait(tab, f"{FAR} === {MANY}")
    host.call(host.one.session.set_class, fleet.mounts[3], "selected", True)
    host.call(fleet.robots[4].append, svg.path(d="M0 0H9", stroke="red"))
    wait(tab, f"{FAR} === {MANY - 2}")
    marked = tab.locator(".far-robots > [data-selected]")
    assert marked.bounding_box()["width"] == pytest.approx(12, abs=1)
    assert not tab.locator("[data-robot=r3].far, [data-robot=r4].far").count()
    host.call(host.one.session.set_class, fleet.mounts[3], "selected", False)
    wait(tab, f"{FAR} === {MANY - 1}")


def test_a_small_robot_is_hovered_and_clicked_like_any_other(host, tab):
    def build(shown):
        fleet = shown.fleet = Fleet(shown)
        fleet.root.on("click", print)
        for mount, robot in zip(fleet.mounts, fleet.robots, strict=True):
            shown.session.listen(mount, robot.id, "click", stop=True)

    host.build = build
    tab.goto(host.url)
    wait(tab, f"{FAR} === {MANY}")
    robots = host.one.fleet.robots
    x, y = 10 + 350 - 100, 5 + 250 + 30  # of the first robot
    tab.mouse.move(x + 3, y + 2)
    wait(tab, f"{FAR} === {MANY - 1}")
    over = f"document.elementFromPoint({x}, {y}).parentNode.dataset.robot"
    assert tab.evaluate(over) == "r0"
    tab.mouse.click(x, y)
    (event,) = wait_for(lambda: host.events(ElementEvent), page=tab)
    assert event.element == robots[0].id
    tab.mouse.move(x - 100, y + 100)
    wait(tab, f"{FAR} === {MANY}")
    # A finger presses beside a robot, without a pointer move before the press.
    tab.evaluate(
        """([x, y]) => {
          const at = { clientX: x, clientY: y, bubbles: true, cancelable: true };
          const svg = document.querySelector("svg.webmap");
          const finger = { ...at, pointerType: "touch" };
          svg.dispatchEvent(new PointerEvent("pointerdown", finger));
          svg.dispatchEvent(new MouseEvent("click", { ...at, detail: 1 }));
        }""",
        [x + 12, y + 4],
    )
    wait_for(lambda: len(host.events(ElementEvent)) == 2, page=tab)
    assert host.events(ElementEvent)[1].element == robots[1].id
    tab.mouse.click(x - 100, y + 100)
    wait_for(lambda: len(host.events(ElementEvent)) == 3, page=tab)
    assert host.events(ElementEvent)[2].element == host.one.fleet.root.id


def test_robots_keep_their_groups_while_they_show_scans(host, tab):
    def model():
        dots = svg.path(class_="dot")
        dots.set_dots(struct.pack("<4h", 5000, 0, -5000, 0), 0.001)
        return svg.g(svg.circle(r=0.5), svg.g(dots, class_="laserscan"))

    opened(host, tab, model=model)
    drawn = "[...document.querySelectorAll('.dot')].filter(e => e.getAttribute('d'))"
    wait(tab, f"{drawn}.length === {MANY}")
    tab.wait_for_timeout(1500)
    assert tab.evaluate(FAR) == 0
    tab.evaluate(RESTYLE, ".laserscan { display: none }")
    wait(tab, f"{FAR} === {MANY}")
    wait(tab, f"{drawn}.length === 0")  # and the display sends none
    tab.evaluate(RESTYLE, "")
    wait(tab, f"{drawn}.length === {MANY} && {FAR} === 0")


def test_what_a_robot_shows_besides_its_group_costs_few_elements(host, tab):
    opened(host, tab)
    wait(tab, f"{FAR} === {MANY} && {PATHS} === 1")
    nodes = "document.querySelectorAll('svg.webmap *').length"
    assert tab.evaluate(nodes) == 3 * MANY + 4
