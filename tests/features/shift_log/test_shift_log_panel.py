"""The panel of the shift log: what each role sees and may send."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from module_fakes import Channel

import webmap
from webmap import Map
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.core.shift_log import RobotName, ShiftLog
from webmap.core.world_view import least_role
from webmap.features.shift_log import hand_over, shift_panel
from webmap.features.shift_log.hand_over import HandOver, RobotNow
from webmap.features.shift_log.shift_panel import LONGEST_NOTE, MOST_ROWS, ShiftPanel
from webmap.scene.node import Text

PACKAGE = Path(webmap.__file__).parent
BOB = RobotName("r1", "Bob")


@pytest.fixture(autouse=True)
def log(monkeypatch):
    made = ShiftLog()
    monkeypatch.setattr(shift_panel, "shift_log", made)
    monkeypatch.setattr(hand_over, "shift_log", made)
    return made


class Browser:
    def __init__(self, folder, role):
        entry = PageEntry("/", lambda page: None, None, folder, "test")
        self.attached = []
        channel = Channel()
        channel.attach = lambda *args: self.attached.append(args)
        self.page = Page(entry, channel, Viewer("v1", "Ann", role), None, {})
        self.map = Map(self.page.element("map"), 700, 500)
        self.panel = self.map.add_module(ShiftPanel, "/hand-over")
        self.got = []
        self.panel.browser_part.send = self.got.append

    def texts(self):
        message = self.got[-1]
        return [row[-1] for row in message.get("all", message.get("new"))]


@pytest.fixture
def open_page(tmp_path):
    pages = []

    def open_(role="operator"):
        pages.append(Browser(tmp_path, role))
        return pages[-1]

    yield open_
    for each in pages:
        each.page.close()


def test_the_script_and_the_style_of_the_panel_exist(open_page):
    ((_, _, script, options, style),) = open_page("viewer").attached
    assert (PACKAGE / script).is_file()
    assert (PACKAGE / style).is_file()
    assert (options["may"], options["page"]) == (False, "hand-over")


def test_an_open_panel_gets_all_entries_and_then_the_new_ones(open_page, log):
    log.note("note", "one")
    ann = open_page()
    ann.panel.poll()
    assert ann.got == []
    ann.panel.on_message({"show": {"since": "all"}})
    assert ann.texts() == ["one"]
    log.note("note", "two")
    ann.panel.poll()
    assert ann.got[-1]["new"]
    log.note("stop", "pressed STOP", robot=BOB)
    ann.panel.poll()
    # With a robot and a kind that the page could not choose before.
    assert ann.texts() == ["one", "two", "pressed STOP"]
    ann.panel.poll()
    assert len(ann.got) == 3
    ann.panel.on_message({"show": {"since": "all", "robot": "r1"}})
    assert ann.texts() == ["pressed STOP"]
    assert ann.got[-1]["robots"] == [("r1", "Bob")]
    ann.panel.on_message({"show": None})
    log.note("note", "three")
    ann.panel.poll()
    assert len(ann.got) == 4


def test_a_page_gets_the_newest_entries_of_a_long_log(open_page, log):
    for number in range(300):
        log.note("stop", f"{number}", robot=RobotName(f"r{number}", "Bob"))
    ann = open_page()
    ann.panel.on_message({"show": {}})
    assert ann.texts() == [f"{number}" for number in range(300 - MOST_ROWS, 300)]
    assert ann.got[-1]["count"] == 300


@pytest.mark.parametrize("role", ["viewer", "operator", "admin"])
def test_only_an_admin_gets_sign_ins_and_refusals(open_page, log, role):
    page = open_page(role)
    log.note("sign-in-failed", "a sign-in was refused")
    page.panel.on_message({"show": {"since": "all", "kind": "all"}})
    assert page.texts() == ["a sign-in was refused"] * (role == "admin")
    assert page.got[-1]["has"] == ["sign-in-failed"] * (role == "admin")
    log.note("refused", "a command was refused")
    page.panel.poll()
    assert page.texts()[-1:] == ["a command was refused"] * (role == "admin")


def test_notes_and_hand_overs_need_an_operator(open_page):
    panel = open_page().panel
    assert least_role(panel, {"show": {}}) == "viewer"
    assert least_role(panel, {"note": "x", "about": "r1"}) == "operator"
    assert least_role(panel, {"shift": True}) == "operator"


def test_a_note_has_its_person_and_the_robot(open_page, log):
    ann = open_page()
    bob = SimpleNamespace(id="r1", name="Bob")
    ann.map.find_robot = {"r1": bob}.get
    ann.panel.on_message({"note": "  the door is blocked ", "about": "r1"})
    (entry,) = log.entries()
    assert (entry.kind, entry.text) == ("note", "the door is blocked")
    assert (entry.person, entry.verified, entry.robot_name) == ("Ann", True, "Bob")
    assert ann.got == [{"problem": ""}]


@pytest.mark.parametrize("note", ["", "  ", None, 7, ["x"], "x" * (LONGEST_NOTE + 1)])
def test_a_wrong_note_is_refused_in_a_sentence(open_page, log, note):
    ann = open_page()
    ann.panel.on_message({"note": note, "about": ["r1"]})
    assert "1 to 300 characters" in ann.got[-1]["problem"]
    assert log.entries() == ()


def test_too_many_notes_of_one_person_are_refused_in_a_sentence(open_page):
    ann = open_page()
    for number in range(40):
        ann.panel.on_message({"note": f"{number}"})
    assert ann.got[0]["problem"] == ""
    assert "Too many notes" in ann.got[-1]["problem"]


def test_a_hand_over_is_noted(open_page, log):
    open_page().panel.on_message({"shift": True})
    assert [(e.kind, e.person) for e in log.entries()] == [("shift", "Ann")]


def test_the_panel_shows_that_the_log_cannot_be_written(open_page, log):
    folded, open_one = open_page(), open_page()
    open_one.panel.on_message({"show": {}})
    log.trouble, log.lost = "The log could not be written: No space left.", 7
    for page in (folded, open_one):
        page.panel.poll()
        assert page.got[-1]["trouble"] == (
            "The log could not be written: No space left. Missing entries: 7"
        )


def texts_of(node):
    if isinstance(node, Text):
        return node.data
    return " ".join(map(texts_of, node.children))


def test_the_hand_over_has_each_part(open_page, log):
    ann = open_page("viewer")
    log.note("webmap", "WebMap started", event="started")
    log.note("stop", "pressed STOP", robot=BOB, person="a program", stop="s1")
    log.note("note", "the door is blocked")
    log.note("refused", "canary")
    facts = {"distance_m": 12.4, "seconds": 90.0, "top_m_s": 0.5, "age_p50_ms": 40}
    log.note("drive", "drove", robot=BOB, person="Ana", age_p99_ms=95, **facts)
    alert = SimpleNamespace(began=100.0, ended=None, name="Bob", by=None)
    alert.text = "Battery at 9 %"
    over = SimpleNamespace(**{**vars(alert), "text": "No pose", "ended": 200.0})
    seen = SimpleNamespace(**{**vars(over), "text": "canary", "by": "Ana"})
    HandOver(
        ann.page,
        lambda: [RobotNow("r1", "Bob", "hall", "STOP active, pressed by Ana")],
        lambda: [alert, over, seen],
    )
    text = texts_of(ann.page.element("sheet"))
    for part in (
        "Robots out of service (1)",
        "STOP active, pressed by Ana",
        "Battery at 9 %",
        "No pose (over)",
        "Stops (1)",
        "the door is blocked",
        "12 m",
        "2 min",
        "40 ms, at worst 95 ms",
        "100 %",
    ):
        assert part in text, (part, text)
    assert "canary" not in text
