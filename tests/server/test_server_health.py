"""``/healthz`` says what is wrong, and ``/metrics`` has figures for operators."""

import shutil
import sys
from collections import namedtuple
from types import SimpleNamespace

import pytest
from prometheus_client.parser import text_string_to_metric_families

from equipment.server_fakes import TOKEN
from equipment.waiting import wait_for
from webmap import Bridge, Robot
from webmap.base.counts import counts
from webmap.base.errors import ConfigError
from webmap.core.operators import Viewer
from webmap.core.page import site
from webmap.core.runtime import runtime
from webmap.server import health
from webmap.server.access import Settings
from webmap.server.app import WebApp
from webmap.server.health import BridgeFigures, Figures, Findings, RobotFigures
from webmap.server.metrics import MOST_NAMED, rendered

LOCAL = ("127.0.0.1", 5)
SECRETS = "no robot, no address: Bay 7"


@pytest.fixture(scope="module", autouse=True)
def running():
    """The model's thread and the gate, with a robot on a bridge that does not exist."""
    runtime.start()

    def make():
        bridge = Bridge("ws://127.0.0.1:1", name=f"bridge, {SECRETS}")
        robot = Robot(SECRETS)
        robot.set_twist_topic(bridge, "/cmd_vel", v_max=1.0, w_max=1.0)
        return bridge, robot

    kept = runtime.run(make)
    wait_for(lambda: runtime.run(lambda: health._of_gate(health._figures())) == [])
    yield kept
    runtime.run(kept[1].destroy)
    runtime.stop()


@pytest.fixture
def local(app, make_client):
    """A program of this machine that has not signed in."""
    return make_client(app, client=LOCAL)


def samples(text):
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_everybody_learns_whether_webmap_works_and_those_who_signed_in_why(
    client, stranger
):
    for asks in (stranger, client):
        answer = asks.get("/healthz")
        assert answer.status_code == 200
        assert answer.json()["status"] == "ok"
    assert answer.json()["problems"] == []
    assert "bridges are open." in answer.json()["notes"][0]
    assert stranger.get("/healthz").json() == {"status": "ok"}
    assert stranger.get("/healthz").headers["connection"] == "close"


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        ("disk", "The disk of the folder for state is full (1 MiB are free)"),
        ("gate", "The gate does not run"),
        ("silent", "The gate has not answered for 2.0 s"),
        ("model", "WebMap's program does not answer"),
    ],
)
def test_what_is_wrong_is_a_sentence_and_status_503(
    client, stranger, monkeypatch, broken, words
):
    usage = namedtuple("usage", "free")(1 << 20)
    seen = runtime.run(health._figures)
    age = {"gate": None, "silent": 2.0}.get(broken)

    async def asked():
        return None if broken == "model" else seen._replace(tick_age=age)

    if broken == "disk":
        monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    else:
        monkeypatch.setattr(health, "_ask", asked)
    answer = client.get("/healthz")
    assert answer.status_code == 503
    assert words in answer.json()["problems"][0]
    refused = stranger.get("/healthz")
    assert (refused.status_code, refused.json()) == (503, {"status": "not ok"})


def test_a_certificate_that_expires_soon_is_a_note(app, client, monkeypatch):
    monkeypatch.setattr(health.time, "time", lambda: 1e9)
    app.health.certificate = SimpleNamespace(ends=lambda: 1e9 + 6 * 86_400)
    answer = client.get("/healthz")
    assert answer.status_code == 200
    assert "The certificate expires on 2001-09-15." in answer.json()["notes"]


def test_programs_of_this_machine_get_the_figures_without_a_sign_in(local, client):
    found = samples(local.get("/metrics").text)
    assert found["webmap_healthy",] == 1
    assert found["webmap_robot_stopped", SECRETS] == 0
    assert found["webmap_bridge_open", f"bridge, {SECRETS}"] == 0
    assert found["webmap_robots", "no_bridge"] + found["webmap_robots", "down"] >= 1
    assert 0 < found["webmap_gate_tick_gap_seconds",] < 60
    for process in ("process", "webmap_gate_process"):
        assert found[f"{process}_resident_memory_bytes",] > 1e6
    assert client.get("/metrics").status_code == 200  # the token is an admin's


@pytest.mark.parametrize(
    ("client", "headers"),
    [
        (("192.0.2.7", 5), {}),
        (("::ffff:192.0.2.7", 5), {}),
        (LOCAL, {"x-forwarded-for": "192.0.2.7"}),
        (LOCAL, {"forwarded": "for=192.0.2.7"}),
        (LOCAL, {"via": "1.1 nginx"}),
        (LOCAL, {"host": "webmap.example.com"}),
    ],
)
def test_all_others_get_no_figures(rooms, make_client, client, headers):
    hosts = health_hosts()
    app = WebApp(
        rooms.site, rooms.model, rooms.gate, Settings(token=TOKEN, hosts=hosts)
    )
    answer = make_client(app, client=client).get("/metrics", headers=headers)
    assert answer.status_code == 401
    assert "webmap_" not in answer.text


def health_hosts():
    from webmap.server.origins import Hosts

    return Hosts.of_binding("127.0.0.1", ["webmap.example.com"])


def test_behind_a_configured_proxy_nobody_counts_as_of_this_machine(rooms, make_client):
    settings = Settings(token=TOKEN, origins=frozenset({"https://example.com"}))
    app = WebApp(rooms.site, rooms.model, rooms.gate, settings)
    assert make_client(app, client=LOCAL).get("/metrics").status_code == 401


def test_who_is_no_admin_gets_no_figures(rooms, make_client):
    settings = Settings(authenticate=lambda scope: Viewer("v", "Vic", "operator"))
    app = WebApp(rooms.site, rooms.model, rooms.gate, settings)
    answer = make_client(app, client=LOCAL).get("/metrics")
    assert answer.status_code == 403
    assert "Only an admin may do this." in answer.text


def test_the_number_of_labels_has_a_bound():
    robots = [RobotFigures(f"r{n}", "free", (), 0.1, n > 990) for n in range(1000)]
    bridges = [BridgeFigures(f"b{n}", True, 0.1) for n in range(1000)]
    figures = Figures(robots, bridges, 7, None, 0.1, 0.06)
    text, _ = rendered(Findings([], [], figures), 3, 2, "text/plain")
    found = samples(text.decode())
    assert len([1 for key in found if key[0] == "webmap_robot_stopped"]) == MOST_NAMED
    assert len(found) < 5 * MOST_NAMED
    assert found["webmap_robots", "free"] == 1000
    assert found["webmap_stops",] == 9
    assert found["webmap_refused_messages_total",] == 7


def test_two_robots_of_one_name_have_figures_of_their_own():
    assert health._unique([("a", "1"), ("a", "2"), ("b", "3")]) == [
        "a (1)",
        "a (2)",
        "b",
    ]


def test_without_the_extra_the_answer_names_its_installation(local, monkeypatch):
    monkeypatch.setitem(sys.modules, "prometheus_client", None)
    monkeypatch.delitem(sys.modules, "webmap.server.metrics")
    answer = local.get("/metrics")
    assert answer.status_code == 501
    assert "pip install 'webmap[metrics]'" in answer.text


@pytest.mark.parametrize("path", ["/healthz", "/metrics"])
def test_no_page_can_have_the_path_of_a_report(path):
    with pytest.raises(ConfigError, match="'/healthz' or '/metrics'"):
        site.page(path)


def test_what_is_sent_to_pages_is_counted(client, rooms):
    before, url = counts["sent_bytes"], "ws://127.0.0.1:8000/_webmap/scene?id=p&page=/"
    headers = {"origin": "http://127.0.0.1:8000"}
    key = client.headers["webmap-key"]
    with client.websocket_connect(url, ["webmap", key], headers=headers) as socket:
        rooms.model.scenes[0].socket.offer(b"abc")
        assert socket.receive_bytes() == b"abc"
        found = samples(client.get("/metrics").text)
        assert found["webmap_pages",] == found["webmap_viewers",] == 1
        assert found["webmap_sent_bytes_total",] == before + 3
        socket.close()
