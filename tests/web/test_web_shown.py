"""What the page shows about a driven robot, in a real Chromium."""

import pytest
from input_bench import Bench

pytestmark = pytest.mark.browser

HALO = ".stopping-halo"


def test_a_halo_shows_the_stopping_distance_of_a_driven_robot(bench: Bench) -> None:
    moving = {"state": "driving", "measured": [0.4, 0, 0]}
    bench.gate.change("r1", **moving, reaction=0.6, brake=0.5)
    bench.page.wait_for_selector(HALO)
    halo = bench.page.locator(HALO)
    assert float(halo.get_attribute("r")) == pytest.approx(0.4)
    assert (halo.get_attribute("cx"), halo.get_attribute("cy")) == ("1", "1")
    behind = "halo => halo.nextElementSibling.matches('.robots')"
    assert halo.evaluate(behind), "the halo is behind the robots"
    bench.page.evaluate(
        "document.querySelector('[data-robot=r1]')"
        ".setAttribute('transform', 'translate(2 3) rotate(90)')"
    )
    bench.until(lambda: halo.get_attribute("cx") == "2")
    assert halo.get_attribute("cy") == "3"
    bench.gate.change("r1", measured=[0.01, 0, 0])
    bench.until(lambda: halo.count() == 0)


def test_the_halo_does_not_block_a_click_on_the_robot(bench: Bench) -> None:
    bench.gate.change("r1", state="driving", measured=[1, 0, 0])
    bench.page.wait_for_selector(HALO)
    box = bench.page.locator("#map1").bounding_box()
    bench.page.mouse.click(box["x"] + 440, box["y"] + 110)
    assert bench.page.evaluate("bench.maps[0].selected") == "r1"


def test_the_page_shows_the_sent_the_echoed_and_the_measured_velocity(
    bench: Bench,
) -> None:
    bench.drive()
    bench.gate.change(
        "r1", sent=[0.3, 0, 0], echoed=[0.2, 0, 0], measured=[-0.1, 0, 0.5], age=42.0
    )
    figures = bench.page.locator(".webmap-teleop-figures dd")
    bench.until(lambda: figures.nth(0).inner_text() == "0.30 m/s, 0.00 rad/s")
    assert figures.nth(1).inner_text() == "0.20 m/s, 0.00 rad/s"
    assert figures.nth(2).inner_text() == "-0.10 m/s, 0.50 rad/s"
    assert figures.nth(3).inner_text() == "42 ms"
    bench.until(lambda: figures.nth(4).inner_text().endswith(" ms"))


WITHOUT_LINK = """() => {
    window.shown = [];
    bench.drive.on("step", () => {
        if (bench.drive.state !== "lost") return;
        const figures = document.querySelector(".webmap-teleop-figures");
        shown.push(figures.checkVisibility(), document.querySelector("HALO") !== null);
    });
}""".replace("HALO", HALO)
"""Records whether figures and halos are shown while the connection is lost."""


def test_speeds_and_halos_are_hidden_while_the_connection_is_lost(bench: Bench) -> None:
    bench.drive()
    bench.gate.change("r1", state="driving", measured=[0.4, 0, 0])
    bench.page.wait_for_selector(HALO)
    bench.until(bench.page.locator(".webmap-teleop-figures").is_visible)
    bench.page.evaluate(WITHOUT_LINK)
    bench.cut()
    bench.until(lambda: bench.page.evaluate("shown.length") > 1)
    assert set(bench.page.evaluate("shown")) == {False}


def test_the_command_timeout_and_the_stop_test_of_a_robot_are_shown(
    bench: Bench,
) -> None:
    bench.select("r1")
    tested = {"stop_source": "tested", "stop_date": "2026-11-21"}
    bench.gate.change("r1", stop_time=0.31, **tested)
    own = bench.page.locator(".webmap-teleop-own")
    text = "Command timeout of the base: 0.31 s (tested 2026-11-21)."
    bench.until(lambda: own.inner_text() == text)
    bench.gate.change("r1", test={"state": "creeping", "text": "creeping at 0.1 m/s"})
    test = bench.page.locator(".webmap-teleop-test")
    bench.until(lambda: test.inner_text() == "Stop test: creeping at 0.1 m/s")


def test_a_stop_test_starts_only_after_a_second_press(bench: Bench) -> None:
    bench.drive()
    bench.page.keyboard.up("w")
    bench.gate.change("r1", stop_time=None, stop_source=None, stop_date=None)
    button = bench.page.locator(".webmap-stop-test")
    button.click()
    bench.page.wait_for_timeout(450)
    assert bench.gate.of("stop-test") == []
    assert button.inner_text() == "Robot will move slowly: press again"
    button.click()
    bench.until(
        lambda: bench.gate.of("stop-test") == [{"op": "stop-test", "robot": "r1"}]
    )
    bench.gate.change("r1", test={"state": "creeping", "text": "creeping"})
    bench.until(lambda: not button.is_visible())
    state = bench.page.locator(".webmap-teleop-state")
    bench.until(lambda: "Stop test running" in state.inner_text())
    bench.gate.change("r1", test={"state": "done", "text": ""}, stop_time=0.3)
    bench.until(lambda: "0.30 s" in bench.page.inner_text(".webmap-teleop-own"))
    bench.until(button.is_visible)
    assert button.inner_text() != "Robot will move slowly: press again", (
        "a new stop test can be requested"
    )


def test_an_alarm_of_the_gate_covers_the_page_and_stop_still_works(open_bench) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.gate.change("r1", alarm="zero sent, still moving at 0.31 m/s")
    alarm = bench.page.get_by_role("alert")
    alarm.wait_for(timeout=5000)
    shown = alarm.inner_text()
    assert "ROBOT NOT OBEYING" in shown
    assert "Use the emergency stop of the robot." in shown
    assert "Robot r1: zero sent, still moving at 0.31 m/s" in shown
    alarm.get_by_role("button", name="STOP ALL").click()
    bench.until(lambda: bench.gate.of("stop") == [{"op": "stop", "robot": "*"}])
    bench.page.keyboard.press("Shift+Escape")
    bench.until(lambda: len(bench.gate.of("stop")) == 2)
    bench.gate.change("r1", alarm="zero sent, still moving at 0.12 m/s")
    bench.until(lambda: "0.12" in alarm.inner_text())
    bench.page.get_by_role("button", name="Acknowledge").click()
    alarm.wait_for(state="detached")
    bench.gate.change("r1", alarm="zero sent, still moving at 0.11 m/s")
    bench.page.wait_for_timeout(200)
    assert alarm.count() == 0, "an acknowledged alarm is not shown again"
    bench.gate.change("r1", alarm=None)
    alarm_of_r1 = "bench.drive.robots.get('r1').alarm"
    bench.until(lambda: bench.page.evaluate(alarm_of_r1) is None)
    bench.page.evaluate("bench.step()")
    bench.gate.change("r1", alarm="zero sent, still moving at 0.40 m/s")
    alarm.wait_for(timeout=5000)


IN_THE_MIDDLE = """() => {
    const title = document.querySelector(".webmap-alarm-title").getBoundingClientRect();
    const page = [innerWidth / 2, innerHeight / 2];
    const heading = [title.x + title.width / 2, title.y + title.height / 2];
    const at = (x, y) => document.elementFromPoint(x, y).closest(".webmap-alarm");
    return at(...page) !== null && at(...heading) !== null;
}"""
"""Whether the alarm is visible in the middle of the page and at its title."""

OPEN = """(kind) => {
    const cover = document.createElement(kind === "dialog" ? "dialog" : "section");
    if (kind !== "dialog") cover.popover = kind;
    for (const side of ["position", "inset", "width", "height"]) {
        cover.style[side] = {position: "fixed", inset: 0}[side] ?? "100%";
    }
    document.body.append(cover);
    if (kind === "dialog") cover.show();
    else cover.showPopover();
}"""


def test_the_alarm_stays_above_popovers_and_dialogs(open_bench) -> None:
    phone = {"width": 390, "height": 844}
    bench = open_bench(
        "?modules=stop/stop_button,drive/teleop", viewport=phone, has_touch=True
    )
    bench.page.evaluate(OPEN, "auto")
    bench.gate.change("r1", alarm="zero sent, still moving at 0.31 m/s")
    alarm = bench.page.get_by_role("alert")
    alarm.wait_for(timeout=5000)
    assert bench.page.evaluate(IN_THE_MIDDLE)
    assert alarm.bounding_box() == {"x": 0, "y": 0, **phone}
    for kind in ("manual", "auto", "dialog"):
        bench.page.evaluate(OPEN, kind)
        bench.until(lambda: bench.page.evaluate(IN_THE_MIDDLE))
    alarm.get_by_role("button", name="STOP ALL").click()
    bench.until(lambda: len(bench.gate.of("stop")) == 1)
    bench.page.keyboard.press("Escape")
    bench.until(lambda: len(bench.gate.of("stop")) == 2)
    bench.gate.change("r1", alarm=None)
    alarm.wait_for(state="detached")
    bench.page.evaluate(OPEN, "auto")
    bench.page.wait_for_timeout(100)
    assert alarm.count() == 0


def test_the_alarms_of_two_maps_do_not_raise_each_other_endlessly(
    open_bench,
) -> None:
    bench = open_bench("?two&modules=stop/stop_button,drive/teleop")
    bench.page.evaluate(
        """() => {
            window.toggles = 0;
            document.addEventListener("toggle", () => { toggles += 1; }, true);
        }"""
    )
    bench.gate.change("r1", alarm="zero sent, still moving at 0.31 m/s")
    bench.page.get_by_role("alert").first.wait_for(timeout=5000)
    bench.page.evaluate(OPEN, "auto")
    bench.page.wait_for_timeout(300)
    assert bench.page.evaluate("toggles") < 10


def test_the_default_stroke_width_of_a_robot_can_be_overridden(
    bench: Bench,
) -> None:
    bench.page.add_style_tag(url="/_webmap/web/webmap.css")
    widths = bench.page.evaluate(
        """() => {
            const robot = document.querySelector('[data-robot=r1]');
            const add = (attributes) => {
                const path = document.createElementNS(robot.namespaceURI, 'path');
                for (const [name, value] of Object.entries(attributes)) {
                    path.setAttribute(name, value);
                }
                robot.append(path);
                return getComputedStyle(path).strokeWidth;
            };
            const own = [
                add({}), add({'stroke-width': '0.2'}),
                add({'vector-effect': 'non-scaling-stroke'}),
                add({'vector-effect': 'non-scaling-stroke', 'stroke-width': '4'}),
            ];
            robot.setAttribute('stroke-width', '0.5');
            return [...own, getComputedStyle(robot).strokeWidth];
        }"""
    )
    assert widths == ["0.03px", "0.2px", "1px", "4px", "0.5px"]
