"""What a browser loads until the console shows a robot, and afterwards.

The tests count requests, bytes and files that the browser keeps; they measure no time.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from urllib.parse import urlsplit

import pytest
from console_ready import wait_until_ready
from playwright.sync_api import Browser, Page, Route

from equipment.waiting import wait_for
from webmap.server.bundles import FIRST_SHEETS, LATER, PART_SHEETS, PARTS, STARTS
from webmap.server.own_files import own_files

pytestmark = pytest.mark.browser

ROBOTS = 1

MOST_REQUESTS = 15
MOST_BYTES = 110_000
"""The limits until the first robot is shown. The page needs about 12 requests and 97 kB
with the images of the map."""

MOST_REQUESTS_IN_ALL = 15

BINARY = 2
"""The opcode of a frame of the scene; all other frames are text."""

WATCH = """
const look = () => {
  if (document.querySelector(".robot:not(.unplaced)")) {
    globalThis.firstRobot = (performance.timeOrigin + performance.now()) / 1000;
  } else requestAnimationFrame(look);
};
look();
"""


@dataclass
class Answer:
    """One request and its response."""

    url: str
    begun: float
    """When the request was sent, as a Unix time in seconds, as the other times."""
    offset: float
    """The difference between Unix time and the browser's own."""
    ended: float = float("inf")
    size: int = 0
    status: int = 0
    headers: dict[str, str] = field(default_factory=dict)
    stored: bool = False
    """Whether the response came from the cache of the browser."""

    @property
    def path(self) -> str:
        return urlsplit(self.url).path


class Loading:
    """Everything that a page loads by HTTP."""

    def __init__(self, page: Page) -> None:
        self.answers: dict[str, Answer] = {}
        self.redirects = 0
        self.first_picture = float("inf")
        """When the first frame of the scene arrived, by the time of the browser."""
        self.asked: list[str] = []
        """The messages that the page sent before the first frame of the scene."""
        self._sockets: set[str] = set()
        """The sockets of this page; until a reload, the page before has others."""
        session = self._session = page.context.new_cdp_session(page)
        session.on("Network.requestWillBeSent", self._sent)
        session.on("Network.requestServedFromCache", self._from_cache)
        session.on("Network.responseReceived", self._answered)
        session.on("Network.loadingFinished", self._finished)
        session.on("Network.webSocketCreated", self._opened)
        session.on("Network.webSocketFrameReceived", self._received)
        session.on("Network.webSocketFrameSent", self._wrote)
        session.send("Network.enable")

    def end(self) -> None:
        """Stop recording."""
        self._session.detach()

    def _sent(self, event: dict) -> None:
        if not event["request"]["url"].startswith("http"):
            return  # a data or blob URL of the page itself
        self.redirects += "redirectResponse" in event
        at = event["wallTime"]
        answer = Answer(event["request"]["url"], at, at - event["timestamp"])
        self.answers[event["requestId"]] = answer

    def _from_cache(self, event: dict) -> None:
        if event["requestId"] in self.answers:
            self.answers[event["requestId"]].stored = True

    def _answered(self, event: dict) -> None:
        if event["requestId"] not in self.answers:
            return
        answer, response = self.answers[event["requestId"]], event["response"]
        answer.status = response["status"]
        answer.headers = {k.lower(): v for k, v in response["headers"].items()}
        answer.stored |= response.get("fromDiskCache", False)

    def _opened(self, event: dict) -> None:
        self._sockets.add(event["requestId"])

    def _received(self, event: dict) -> None:
        own = event["requestId"] in self._sockets
        if own and event["response"]["opcode"] == BINARY:
            self.first_picture = min(self.first_picture, event["timestamp"])

    def _wrote(self, event: dict) -> None:
        own = event["requestId"] in self._sockets
        if own and event["timestamp"] < self.first_picture:
            self.asked.append(event["response"]["payloadData"])

    def _finished(self, event: dict) -> None:
        if event["requestId"] not in self.answers:
            return
        answer = self.answers[event["requestId"]]
        answer.size = event["encodedDataLength"]
        answer.ended = event["timestamp"] + answer.offset


@dataclass
class Opened:
    """A page of the console that was opened in a new browser, and loaded again."""

    loading: Loading
    first_robot: float
    again: Loading

    def before_robot(self) -> list[Answer]:
        """Return what was requested before the first robot was shown."""
        answers = self.loading.answers.values()
        return [one for one in answers if one.begun < self.first_robot]


@pytest.fixture(scope="module")
def opened(chromium: Browser, demo) -> Iterator[Opened]:
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.add_init_script(WATCH)
    loading = Loading(page)
    page.goto(demo.url)
    page.locator(".robot:not(.unplaced)").first.wait_for(state="attached")
    wait_until_ready(page)
    first_robot = page.evaluate("firstRobot")
    loading.end()
    again = Loading(page)
    page.reload()
    page.locator(".robot:not(.unplaced)").first.wait_for(state="attached")
    wait_until_ready(page)
    again.end()
    yield Opened(loading, first_robot, again)
    context.close()


def test_the_first_robot_is_shown_after_few_requests_and_bytes(opened: Opened) -> None:
    before = opened.before_robot()
    requests = len(before) + opened.loading.redirects
    assert requests <= MOST_REQUESTS, [one.url for one in before]
    sizes = {one.path: one.size for one in before}
    assert 0 < sum(sizes.values()) <= MOST_BYTES, sizes


def test_the_first_picture_comes_without_a_message_of_the_page(opened: Opened) -> None:
    assert opened.loading.asked == []
    assert opened.again.asked == []


@pytest.mark.parametrize("late", [r"/web/page\.js", r"/console/console\.css"])
def test_the_first_picture_comes_while_the_page_still_loads(
    demo, chromium, late
) -> None:
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    held: list[Route] = []
    page.route(re.compile(late), lambda route: held.append(route))
    with page.expect_websocket() as scene:
        page.goto(demo.url, wait_until="commit")
    with scene.value.expect_event("framereceived"):
        pass
    assert held
    robots = page.locator(".robot:not(.unplaced)")
    assert robots.count() == 0
    held[0].continue_()
    robots.first.wait_for(state="attached")
    context.close()


def test_only_stop_and_driving_are_loaded_before_the_first_robot_is_shown(
    opened: Opened,
) -> None:
    begun = {one.path for one in opened.before_robot()}
    files = f"/_webmap/v-{own_files.version()}/"
    assert files + FIRST_SHEETS in begun
    assert not {files + PARTS, files + PART_SHEETS} & begun
    assert not [path for path in begun if "/features/" in path]


def test_stop_and_driving_do_not_wait_for_the_first_picture(opened: Opened) -> None:
    begun = {one.path for one in opened.before_robot()}
    files = f"/_webmap/v-{own_files.version()}/"
    # The HTML has the first bundle.
    assert files + STARTS[0] not in begun
    assert {files + name for name in STARTS[1:]} <= begun


def test_the_second_picture_waits_until_driving_is_loaded(demo, chromium) -> None:
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    held: list[Route] = []
    page.route(re.compile("/web/drive\\.js"), lambda route: held.append(route))
    sent: list[str] = []
    page.on("websocket", lambda scene: scene.on("framesent", lambda t: sent.append(t)))
    page.goto(demo.url)
    page.locator(".robot:not(.unplaced)").first.wait_for(state="attached")
    page.evaluate("() => new Promise((done) => setTimeout(done, 100))")
    assert not [text for text in sent if '"seen"' in text]
    held[0].continue_()
    wait_for(lambda: [t for t in sent if '"seen"' in t], "an answer", 30.0, page)
    context.close()


def test_pictures_come_also_if_driving_cannot_be_loaded(demo, chromium) -> None:
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.route(re.compile("/web/drive\\.js"), lambda route: None)  # never answered
    sent: list[str] = []
    page.on("websocket", lambda scene: scene.on("framesent", lambda t: sent.append(t)))
    page.goto(demo.url)
    wait_for(lambda: len([t for t in sent if '"seen"' in t]) > 3, "more", 30.0, page)
    context.close()


def test_a_page_works_if_a_proxy_forbids_the_script_in_the_html(demo, chromium) -> None:
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    # Chromium does not know that the answers of the test come from this machine.
    context.grant_permissions(["local-network-access"])
    page = context.new_page()

    def forbid(route: Route) -> None:
        answer = route.fetch()
        policy = answer.headers["content-security-policy"]
        strict = re.sub(" 'sha256-[^']*'", "", policy)
        headers = {**answer.headers, "content-security-policy": strict}
        route.fulfill(response=answer, headers=headers)

    page.goto(demo.url)
    page.route(lambda url: urlsplit(url).path == "/", forbid)
    refused: list[str] = []
    page.on("console", lambda message: refused.append(message.text))
    page.reload()
    page.locator(".robot:not(.unplaced)").first.wait_for(state="attached")
    assert any("Content Security Policy" in text for text in refused)
    wait_until_ready(page)
    context.close()


def test_the_whole_console_loads_each_file_once(opened: Opened) -> None:
    answers = list(opened.loading.answers.values())
    assert len(answers) <= MOST_REQUESTS_IN_ALL
    loaded = [one.url for one in answers if not one.stored]
    assert len(loaded) == len(set(loaded))


def test_what_is_imported_when_it_is_used_is_not_loaded_before(opened: Opened) -> None:
    paths = [one.path for one in opened.loading.answers.values()]
    files = f"/_webmap/v-{own_files.version()}/"
    assert files + PARTS in paths
    assert files + LATER not in paths


def test_all_that_is_loaded_is_compressed_and_never_asked_for_again(
    opened: Opened,
) -> None:
    document, *files = opened.loading.answers.values()
    assert document.headers["content-encoding"] == "gzip"
    assert document.headers["cache-control"] in ("no-store", "no-cache")
    assert files
    for one in files:
        assert one.status == 200, one.url
        assert "immutable" in one.headers["cache-control"], one.url
        text = one.headers["content-type"].startswith(("text/", "image/svg"))
        if text and one.headers.get("content-encoding") != "gzip":
            assert int(one.headers["content-length"]) < 500, one.url


def test_a_page_that_is_loaded_again_asks_for_its_html_only(opened: Opened) -> None:
    asked = [one.path for one in opened.again.answers.values() if not one.stored]
    assert asked == ["/"]


PARTS_STYLE = f"""() => [...document.querySelectorAll("link[rel=stylesheet]")]
  .filter(({{ href, sheet }}) => sheet && href.endsWith("/{PART_SHEETS}"))
  .map(({{ media }}) => media)"""
"""The media of the style sheet of the parts, once it is loaded."""


def test_the_styles_of_parts_apply_together_with_the_parts(demo, chromium) -> None:
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    held: list[Route] = []
    page.route(re.compile(rf"/{PARTS}$"), lambda route: held.append(route))
    page.goto(demo.url)
    wait_for(lambda: page.evaluate(PARTS_STYLE) == ["not all"], "the sheet", 30.0, page)
    wait_for(lambda: held, "the request of the parts", 30.0, page)
    held[0].continue_()
    wait_until_ready(page)
    assert page.evaluate(PARTS_STYLE) == ["all"]
    context.close()
