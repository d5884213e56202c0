"""Which cameras an agent fetches, which pictures it sends, and how old they are."""

import msgspec
import pytest

from equipment.camera_server import a_jpeg
from webmap.agents import camera_messages
from webmap.agents.address import Sender, camera_key
from webmap.agents.agent_cameras import (
    AHEAD,
    EXPIRY,
    MOST_DISPLAYS,
    PATIENCE,
    CameraRelay,
    CameraSource,
    cameras_of,
)
from webmap.agents.camera_messages import (
    AgentClock,
    CameraRelease,
    CameraRequest,
    PictureMessage,
)
from webmap.agents.remote_camera import RemoteCamera
from webmap.base.errors import ConfigError, WireError
from webmap.config.robot import RobotConfig
from webmap.ros.messages_image import MAX_BYTES

ANN, BEN = Sender("ann", "4f"), Sender("ben", "5e")
FRONT = ("r1", "Front")
HELD = CameraSource("http://cam/stream", 200)
PICTURE = a_jpeg()


class Bench:
    def __init__(self):
        self.fetched, self.sent, self.answers = [], [], []
        self.cameras = CameraRelay(
            begin=lambda name, camera: self.fetched.append(name),
            end=self.fetched.remove,
            send=lambda name, picture: self.sent.append(picture),
            answer=lambda client, looked: self.answers.append((client, looked)),
        )
        self.cameras.set_cameras({FRONT: HELD})

    def look(self, client, now=0.0, newest=0, name=FRONT):
        self.cameras.receive(client, CameraRequest(1, *name, newest), now)

    def picture(self, now=0.0, data=PICTURE):
        self.cameras.picture(FRONT, data, now)

    @property
    def trouble(self):
        return self.answers[-1][1].trouble


@pytest.fixture
def bench():
    return Bench()


def test_a_camera_is_fetched_once_while_any_display_looks(bench):
    assert bench.fetched == []
    bench.look(ANN)
    bench.look(BEN)
    assert bench.fetched == [FRONT]
    bench.cameras.receive(ANN, CameraRelease(*FRONT), 1.0)
    assert bench.fetched == [FRONT]
    bench.cameras.receive(BEN, CameraRelease(*FRONT), 1.0)
    assert bench.fetched == []
    bench.picture()
    bench.cameras.complain(FRONT, "it is late")
    bench.cameras.receive(BEN, CameraRelease(*FRONT), 1.0)
    assert bench.sent == []


def test_a_display_that_is_gone_looks_no_more(bench):
    bench.look(ANN)
    bench.look(BEN, 3.0)
    bench.cameras.check(EXPIRY + 1.0)
    assert bench.fetched == [FRONT]
    bench.cameras.check(EXPIRY + 3.1)
    assert bench.fetched == []


@pytest.mark.parametrize("name", [("r1", "Rear"), ("r2", "Front"), ("", "")])
def test_a_camera_that_the_agent_does_not_have_is_not_fetched(bench, name):
    bench.look(ANN, name=name)
    assert bench.fetched == []
    assert bench.trouble == "the agent has no such camera"


def test_a_changed_camera_ends_and_the_next_look_begins_the_new_one(bench):
    bench.look(ANN)
    bench.cameras.set_cameras({FRONT: HELD})
    assert bench.fetched == [FRONT]
    bench.cameras.set_cameras({FRONT: HELD._replace(url="http://cam/other")})
    assert bench.fetched == []
    bench.look(ANN)
    assert bench.fetched == [FRONT]


def test_a_picture_is_sent_once_for_all_displays_with_the_time_when_it_came(bench):
    bench.look(ANN)
    bench.look(BEN)
    bench.picture(now=7.0)
    (picture,) = bench.sent
    assert (picture.clock, picture.data) == (7.0, PICTURE)


def test_of_pictures_that_the_link_does_not_carry_only_the_newest_is_sent(bench):
    bench.look(ANN)
    for now in range(10):
        bench.picture(now / 10)
    assert [each.clock for each in bench.sent] == [0.0, 0.1]
    assert len(bench.sent) == AHEAD
    bench.look(ANN, 1.0, newest=bench.sent[0].number)
    assert [each.clock for each in bench.sent[AHEAD:]] == [0.9]
    bench.look(ANN, 1.1, newest=bench.sent[0].number)  # the same answer again
    assert len(bench.sent) == AHEAD + 1


def test_the_display_that_gets_pictures_first_decides(bench):
    bench.look(ANN)
    bench.look(BEN)
    for number in range(20):
        bench.picture(number / 10)
        bench.look(BEN, number / 10, newest=bench.sent[-1].number)
    assert len(bench.sent) == 20


def test_pictures_continue_after_lost_ones(bench):
    bench.look(ANN)
    for _ in range(AHEAD + 1):
        bench.picture()
    bench.look(ANN, PATIENCE - 0.1)
    assert len(bench.sent) == AHEAD
    bench.look(ANN, PATIENCE + 0.1)
    assert len(bench.sent) == AHEAD + 1


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"<svg onload=x>", "it sends a picture with the format '' that is not JPEG"),
        (PICTURE + bytes(MAX_BYTES), f"{MAX_BYTES} at most"),
        (a_jpeg(size=(5000, 4000)), "16000000 pixels at most"),
    ],
)
def test_what_is_no_picture_is_not_sent_and_every_display_reads_why(bench, data, words):
    bench.look(ANN)
    bench.picture(data=data)
    assert bench.sent == []
    for client in (ANN, BEN):
        bench.look(client)
        assert words in bench.trouble
    bench.picture()
    bench.look(ANN)
    assert bench.trouble == ""


def test_the_number_of_displays_at_a_camera_is_bounded(bench):
    for number in range(MOST_DISPLAYS):
        bench.look(Sender("ann", str(number)))
    with pytest.raises(WireError, match="100 displays of the user ann"):
        bench.look(Sender("ann", "more"))
    bench.look(BEN)  # another user has places of its own
    bench.look(ANN._replace(instance="0"))


def test_only_cameras_over_http_are_those_of_the_agent():
    cameras = [{"url": "http://me:secret@cam/a?b", "throttle": 50}, "/camera"]
    config = RobotConfig.from_dict({"name": "Bob", "cameras": cameras})
    assert cameras_of([("r1", config)]) == {
        ("r1", "Camera 1"): CameraSource("http://me:secret@cam/a?b", 50)
    }
    config = RobotConfig.from_dict({"name": "Bob", "cameras": "https://cam/a"})
    assert cameras_of([("r1", config)])["r1", "Camera"].throttle == 200


@pytest.mark.parametrize(
    "piece",
    [
        b"",
        b"{}",
        b'{"type":"look","number":1,"robot":"r1"}',
        b'{"type":"look","number":"1","robot":"r1","camera":"Front"}',
        b'{"type":"fetch","url":"http://elsewhere"}',
        msgspec.json.encode(CameraRequest(1, "r1", "x" * 5000)),
    ],
)
def test_what_is_no_look_is_refused(piece):
    with pytest.raises(WireError, match="got a request"):
        camera_messages.read_request(piece)


def test_messages_about_cameras_are_read_as_they_were_written():
    look = CameraRequest(3, "r1", "Front", 2)
    assert camera_messages.read_request(msgspec.json.encode(look)) == look
    away = CameraRelease("r1", "Front")
    assert camera_messages.read_request(msgspec.json.encode(away)) == away
    picture = PictureMessage(7, 1.5, b"data")
    assert (
        camera_messages.read_picture(camera_messages.pack_picture(picture)) == picture
    )
    looked = camera_messages.CameraReply(3, 1.5, "why")
    assert camera_messages.read_reply(msgspec.json.encode(looked)) == looked
    for read in (camera_messages.read_picture, camera_messages.read_reply):
        with pytest.raises(WireError):
            read(b"short")


def test_the_age_of_a_picture_is_never_below_its_true_age():
    clock = AgentClock()
    ahead = 100.0  # the clock of the display
    assert clock.age(0.0, ahead) is None
    clock.asked(1, ahead)
    assert not clock.answered(2, 0.0, ahead)  # it answers another camera
    assert clock.answered(1, 0.3, ahead + 0.4)
    # The agent got the picture at 5.0; the display gets it 0.8 s later.
    assert clock.age(5.0, ahead + 5.8) == pytest.approx(0.8 + 0.3)
    clock.asked(3, ahead + 6.0)
    clock.answered(3, 6.1, ahead + 6.2)
    assert clock.age(7.0, ahead + 7.8) == pytest.approx(0.8 + 0.1)
    clock.asked(4, ahead + 8.0)
    clock.answered(4, 9.5, ahead + 9.6)
    assert clock.age(10.0, ahead + 10.8) == pytest.approx(0.8 + 0.1)


@pytest.mark.parametrize("change", [3600.0, -3600.0])
def test_the_age_is_right_again_after_one_of_the_computers_slept(change):
    clock = AgentClock()
    for number in range(40):
        clock.asked(number, 100.0 + number)
        clock.answered(number, number + 0.1, 100.2 + number)
    ahead = 100.0 + change
    clock.asked(50, ahead + 50.0)
    clock.answered(50, 50.1, ahead + 50.2)
    assert clock.age(51.0, ahead + 51.5) == pytest.approx(0.5 + 0.1)


def test_looks_without_answers_are_forgotten():
    clock = AgentClock()
    for number in range(100):
        clock.asked(number, float(number))
    assert not clock.answered(1, 0.0, 200.0)
    assert clock.answered(99, 99.0, 100.0)


def test_a_camera_beside_an_agent_is_one_address_without_its_own():
    camera = RemoteCamera("zenoh://hall/bay3", "r1", "Front & rear", "http://cam/a")
    assert RemoteCamera.parse(camera.url) == camera
    assert camera.shown == "http://cam/a through the agent bay3"
    assert camera_key("bay3", "r1", "a") != camera_key("bay3", "r1", "b")


@pytest.mark.parametrize(
    "url",
    [
        "zenoh://hall/bay3",
        "zenoh://hall/bay3?robot=r1",
        "zenoh://hall?robot=a&camera=b",
    ],
)
def test_an_address_without_robot_and_camera_is_refused(url):
    with pytest.raises(ConfigError, match="names no robot and camera"):
        RemoteCamera.parse(url)
