"""No bar cuts a word of a state, a reason, a limit or the link, at any size.

The texts are the longest that there are. What has no room is left out as a whole, the
least important first, and no bar changes its height.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from console_ready import select, wait_until_ready
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import hold, watched_tab
from equipment.webmap_process import page_of, simulator
from webmap.console.bar import summary

pytestmark = [pytest.mark.browser, pytest.mark.serial]

SITE = Path(__file__).with_name("bars_site.py")

SIZES = [
    (320, 640),
    (360, 780),
    (390, 844),
    (480, 800),
    (600, 960),
    (768, 1024),
    (512, 300),
    (844, 390),
    (932, 430),
    (897, 600),
    (1024, 600),
    (1280, 800),
    (1400, 900),
    (1440, 900),
    (1920, 1080),
    (3840, 2160),
]
SOME_SIZES = [(320, 640), (844, 390), (1440, 900)]

WALK = """async ({ states, at }) => {
  const { page } = await import(document.querySelector('[src$="page.js"]').src);
  const { drive } = page;
  const replaced = (name, get) =>
    Object.defineProperty(drive, name, { configurable: true, get });
  const frame = () => new Promise((done) => requestAnimationFrame(done));
  await frame();
  await frame();
  const robot = document.querySelector("#robots > .row").dataset.robot;
  const report = drive.robots.get(robot);
  const seen = document.querySelector(`.robot[data-robot="${robot}"]`);
  const was = { ...seen.dataset };
  const shown = (e) => e && e.checkVisibility() && e.getBoundingClientRect().width > 1;

  // What of a rectangle of a text can be seen: 0 nothing, 1 a part, 2 all.
  const sight = (rect, parent) => {
    let { left, right, top, bottom } = rect;
    for (let e = parent; e instanceof Element; e = e.parentElement) {
      const { overflowX, overflowY, position } = getComputedStyle(e);
      const box = e.getBoundingClientRect();
      if (overflowX !== "visible") {
        left = Math.max(left, box.left);
        right = Math.min(right, box.right);
      }
      if (overflowY !== "visible") {
        top = Math.max(top, box.top);
        bottom = Math.min(bottom, box.bottom);
      }
      if (position === "fixed") break;
    }
    [left, right] = [Math.max(left, 0), Math.min(right, innerWidth)];
    [top, bottom] = [Math.max(top, 0), Math.min(bottom, innerHeight)];
    if (right - left < 1 || bottom - top < 1) return 0;
    // The box of a line is higher than its letters.
    const whole = right - left > rect.width - 1.5 && bottom - top > rect.height * 0.75;
    const y = (top + bottom) / 2;
    const hits = [left + 2, (left + right) / 2, right - 2].map((x) => {
      const hit = document.elementFromPoint(x, y);
      return hit !== null && (parent.contains(hit) || hit.contains(parent));
    });
    return whole && hits.every(Boolean) ? 2 : hits.some(Boolean) ? 1 : 0;
  };
  const sights = (node, from = 0, to = node.length) => {
    const range = document.createRange();
    range.setStart(node, from);
    range.setEnd(node, to);
    return [...range.getClientRects()]
      .filter(({ width }) => width > 1)
      .map((rect) => sight(rect, node.parentElement));
  };
  const textsIn = (root) => {
    const walker = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
    const found = [];
    while (walker.nextNode()) {
      const node = walker.currentNode;
      const parent = node.parentElement;
      const names = "bdi, .site";
      const other = parent.closest(`${names}, form, ul, dl, .webmap-tool-body`);
      if (node.data.trim() && !other && shown(parent)) found.push(node);
    }
    return found;
  };
  const bars = [...document.querySelectorAll(".bar, .drive-bar, .webmap-several")]
    .filter(shown);
  const row = document.querySelector("#robots > .row").cloneNode(true);
  delete row.dataset.robot;
  document.querySelector("#robots").append(row);
  const bridges = document.querySelector("#bridges .text");
  const parts = [...bridges.childNodes];
  const wrong = [];
  const heights = {};
  for (const [name, state] of Object.entries(states)) {
    delete drive.status;
    const calm = { settled: true, early: false, taking: false, refusal: null };
    const driven = state.driven ? robot : null;
    const status = { ...drive.status, ...calm, driven, choice: robot, ...state.status };
    replaced("status", () => status);
    replaced("state", () => status.link);
    const free = { conditions: "", state: "free", activity: "free" };
    Object.assign(seen.dataset, free, state.seen);
    const asked = { robot, by: status.connection, left: 10, mine: false, who: "you" };
    replaced("requests", () => (state.asked ? [asked] : []));
    document.querySelector("#link").dataset.link = drive.state;
    drive._receive({ op: "robot", ...report, ...state.report });
    bridges.replaceChildren(...(state.bridges ? [state.bridges] : parts));
    row.querySelector(".state").textContent = state.words.join(" \u00b7 ");
    const where = `${name} at ${at}`;
    const texts = bars.flatMap(textsIn);
    for (const node of texts) {
      const all = sights(node);
      if (new Set(all).size < 2 && !all.includes(1)) continue;
      wrong.push(`${where}: ${node.parentElement.className || node.parentElement.id} `
        + `cuts "${node.data}"`);
    }
    for (const word of state.words) {
      const at = texts
        .map((node) => [node, node.data.toLowerCase().indexOf(word.toLowerCase())])
        .find(([, place]) => place >= 0);
      const all = at ? sights(at[0], at[1], at[1] + word.length) : [];
      if (all.length === 0 || all.some((one) => one < 2)) {
        wrong.push(`${where}: "${word}" is not shown ${all} in `
          + document.querySelector(".webmap-teleop-state").textContent);
      }
    }
    // The most important first: nothing is left out before what follows it.
    const there = [...document.querySelector(".webmap-teleop-words").children]
      .filter(shown);
    const out = there.map((part) => sight(part.getBoundingClientRect(), part) === 0);
    const first = out.indexOf(true);
    if (first >= 0 && out.lastIndexOf(false) > first) {
      wrong.push(`${where}: left out ${there[first].className} too early`);
    }
    for (const bar of [...bars, ...document.querySelectorAll(".bar > *, .drive-bar")]) {
      const box = bar.getBoundingClientRect();
      if (shown(bar) && (box.right > innerWidth + 1 || bar.scrollWidth > innerWidth)) {
        wrong.push(`${where}: ${bar.className} is too wide`);
      }
    }
    for (const bar of [...bars, row]) {
      const { height } = bar.getBoundingClientRect();
      const before = (heights[bar.className] ??= height);
      if (height === before) continue;
      wrong.push(`${where}: ${bar.className} ${before} -> ${height}`);
    }
  }
  row.remove();
  bridges.replaceChildren(...parts);
  delete drive.status;
  delete drive.state;
  delete drive.requests;
  Object.assign(seen.dataset, was);
  drive._receive({ op: "robot", ...report });
  return { wrong, heights };
}"""
"""Go through states of driving and look at every text of both bars, in one task of the
page, so that no message of the gate comes between."""

NAME = "W" * 34
WHY = [
    "stop test failed on 2026-11-29",
    "slow connection: 1250 ms",
    "limit of the robot",
]
FAST = {"sent": [-1.25, 0, -1.5], "measured": [-1.25, 0, -1.5]}
MINE = {
    "mine": True,
    "holder": {"connection": "c1", "name": NAME},
    "epoch": 1,
    "why": WHY,
}
DRIVING = {**MINE, **FAST, "state": "driving", "doing": "driven"}
LINKED = ["Connected", "1 of 3 bridges"]


def state(*words: str, link: str = "open", bar: list[str] = LINKED, **changes) -> dict:
    """Return a state of the page, and the words that must be shown in it."""
    status = {"link": link, **changes.pop("status", {})}
    return {"words": [*words, *bar], "status": status, **changes}


LIMITED = ["Stop test failed on 2026-11-29", "slow connection: 1250 ms"]

STATES = {
    "selected": state(
        "Free",
        "stop not verified",
        report={"doing": "free", "why": ["stop not verified"]},
    ),
    "control": state("You have control", *LIMITED, report={**MINE, "doing": "held"}),
    "driving": state("You are driving", *LIMITED, report=DRIVING, driven=True),
    "blocked": state(
        "You are driving",
        "not moving: blocked?",
        *LIMITED,
        report={**DRIVING, "doing": "blocked"},
        driven=True,
    ),
    "base without timeout": state(
        "You are driving",
        "command timeout of the base over 0.5 s: 12.5 s",
        report={**DRIVING, "why": ["command timeout of the base over 0.5 s: 12.5 s"]},
        driven=True,
    ),
    "autonomous": state(
        "Autonomous",
        "goal failed",
        "battery low",
        report={"doing": "navigating", "why": WHY},
        seen={"activity": "navigating", "conditions": "goal_failed battery_low"},
    ),
    "another": state(
        "has control",
        "refuses",
        asked=True,
        report={
            "holder": {"connection": "c2", "name": "Ann (desk 4)"},
            "doing": "held",
        },
    ),
    "stopped": state(
        "STOP active",
        "confirmed by odometry",
        report={
            "latched": True,
            "state": "stopped",
            "doing": "stopped",
            "stop": {"by": "Ann (desk 4)", "confirmed": True, "why": "", "id": "s1"},
        },
    ),
    "unconfirmed": state(
        "STOP NOT CONFIRMED",
        "no odometry since the STOP",
        report={
            "latched": True,
            "state": "stopped",
            "doing": "unconfirmed",
            "stop": {
                "by": "Ann (desk 4)",
                "confirmed": False,
                "why": "no odometry since the STOP",
                "id": "s1",
            },
        },
    ),
    "input": state(
        "Input blocked: release all keys, then press again",
        report=MINE,
        driven=True,
        status={"pressed": True, "blocked": True},
    ),
    "connecting": state("Preparing input", link="connecting", bar=["Connecting"]),
    "late": state(
        "Slow connection",
        "Command too old (over 300 ms): ignored",
        *LIMITED,
        link="late",
        bar=["Slow connection", "1 of 3 bridges"],
        report=DRIVING,
    ),
    "lost": state(
        "No connection to WebMap",
        "No robot can be driven from this page",
        link="lost",
        bar=["No connection"],
    ),
    "no bridge": state(
        "You have control",
        *LIMITED,
        bar=["Connected", "0 of 3 bridges"],
        report={**MINE, "doing": "held"},
        bridges=summary(["lost", "lost", "connecting"]),
    ),
}

SEVERAL = {
    name: {**STATES[name], "words": [*STATES[name]["words"], "3 robots", "STOP these"]}
    for name in ("control", "late")
}
"""The states while several robots are selected, which another bar shows."""


@pytest.fixture(scope="module")
def page(chromium: Browser) -> Iterator[Page]:
    """Open one page for all tests, with a selected robot and the stick."""
    with (
        simulator("--robots", "3") as bridge,
        page_of(SITE, BRIDGE=bridge) as url,
        watched_tab(chromium, 1440, 900) as page,
    ):
        stated = {"name": NAME, "place": "W" * 24}
        page.add_init_script(
            f"localStorage.setItem('webmap operator', '{json.dumps(stated)}')"
        )
        page.goto(url)
        wait_until_ready(page)
        expect(page.locator("#refused details")).to_be_visible()
        expect(page.locator("#bridges summary")).to_contain_text("1 of 3 bridges")
        select(page, "Robot 0")
        page.locator(".webmap-teleop-stick").click()
        yield page


def resize(page: Page, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})


OPEN = {
    "": "",
    "camera": "document.querySelector('.camera-small').click()",
    "panel": "document.querySelector('.webmap-layers').open = true",
    "several": "document.querySelectorAll('.besides').forEach((box) => box.click())",
}
CLOSE = {
    "": "",
    "camera": "document.querySelector('.camera-close').click()",
    "panel": "document.querySelector('.webmap-layers').open = false",
    "several": "document.querySelector('.webmap-several-clear').click()",
}


@pytest.mark.timeout(300)
@pytest.mark.slow
@pytest.mark.parametrize("sizes", [SOME_SIZES, SIZES], ids=["some sizes", "all sizes"])
def test_no_bar_cuts_a_word_of_a_state_a_reason_or_the_link(page, sizes):
    wrong = []
    for part in OPEN:
        several = part == "several"
        page.evaluate(OPEN[part])
        if several:
            expect(page.locator(".webmap-several")).to_contain_text("3 robots")
        for size in sizes:
            resize(page, size)
            at = f"{size[0]}x{size[1]} {part}".strip()
            found = page.evaluate(
                WALK, {"states": SEVERAL if several else STATES, "at": at}
            )
            wrong += found["wrong"]
        resize(page, (1440, 900))
        page.evaluate(CLOSE[part])
    assert not wrong, "\n".join(wrong)


PLACES = """() => [".webmap-stop-all", ".webmap-teleop-stop"].map((name) => {
  const e = document.querySelector(name);
  const { left, top, right, bottom } = e.getBoundingClientRect();
  const inside = left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight;
  const hit = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
  return inside && e.contains(hit);
})"""
"""Whether each STOP is in the window, and can be pressed."""


def test_stop_is_shown_while_the_window_of_a_driver_changes_its_size(page):
    driving = page.locator(".webmap-teleop[data-state=driving]")
    hold(page.keyboard, "a", driving.is_visible)
    for width in sorted({width for width, _ in SIZES}, reverse=True):
        resize(page, (width, 900))
        assert page.evaluate(PLACES) == [True, True], width
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.keyboard.up("a")
    hold(page.keyboard, "a", driving.is_visible)
    page.keyboard.up("a")


def test_the_tools_that_have_no_room_are_in_more(page):
    tools, more = page.locator(".tools"), page.locator("#tools-more")
    resize(page, (1920, 1080))
    expect(more).to_be_hidden()
    page.evaluate(OPEN["camera"])
    resize(page, (1024, 600))
    log = tools.locator("summary[title=Log]")
    expect(log).to_be_hidden()
    more.click()
    expect(more).to_have_attribute("aria-expanded", "true")
    log.click()
    expect(page.locator(".webmap-rosout")).to_have_attribute("open", "")
    expect(more).to_have_attribute("aria-expanded", "false")
    resize(page, (1920, 1080))
    expect(log).to_be_visible()
    expect(more).to_be_hidden()
    page.evaluate("document.querySelector('.webmap-rosout').open = false")
    page.evaluate(CLOSE["camera"])
