"""The text that shows the state of the bridges."""

import pytest

from webmap import Bridge
from webmap.console.bar import describe_link, summary


class FakeBridge(Bridge):
    state, lag, trouble = "open", 0.0, None


def bridge(state="open", lag=0.0, trouble=None):
    made = FakeBridge("ws://bob:9090")
    made.state, made.lag, made.trouble = state, lag, trouble
    return made


@pytest.mark.parametrize(
    ("bridge", "link", "text"),
    [
        (bridge(), "open", "open"),
        (bridge(lag=0.4), "open", "open"),
        (bridge(lag=1.44), "late", "slow connection, 1.4 s"),
        (bridge("connecting"), "connecting", "connecting"),
        (
            bridge("connecting", trouble="no answer within 5 s", lag=9.0),
            "lost",
            "no connection: no answer within 5 s; reconnecting",
        ),
    ],
)
def test_a_bridge_is_open_late_connecting_or_lost(bridge, link, text):
    assert describe_link(bridge) == (link, text)


def test_an_open_bridge_names_the_faults_of_its_frames(monkeypatch):
    faults = ["a transform was left out: 'a' -> 'b' would close a loop", "2", "3", "4"]
    monkeypatch.setattr("webmap.console.bar.frame_faults", lambda bridge: faults)
    assert describe_link(bridge()) == ("faulty", f"open; {faults[0]}; 2; 3")
    slow = f"slow connection, 1.4 s; {faults[0]}; 2; 3"
    assert describe_link(bridge(lag=1.44)) == ("late", slow)
    assert describe_link(bridge("connecting")) == ("connecting", "connecting")


@pytest.mark.parametrize(
    ("links", "text"),
    [
        (["open"], "Bridge connected"),
        (["late"], "Bridge slow"),
        (["faulty"], "Frames faulty"),
        (["faulty", "open"], "2 bridges connected, faulty frames"),
        (["lost"], "No connection to the bridge"),
        (["connecting"], "Connecting to the bridge"),
        (["open", "open"], "2 bridges connected"),
        (["open", "lost"], "1 of 2 bridges connected"),
        (["open", "late", "lost"], "2 of 3 bridges connected, 1 slow"),
    ],
)
def test_the_states_of_all_bridges_are_summarized_in_one_text(links, text):
    assert summary(links) == text
