"""The link of a page to its display, in a real Chromium."""

import pytest

from equipment.scene_host import wait
from equipment.waiting import wait_for
from webmap.scene.wire.messages import Trouble, ViewReport
from webmap.scene.wire.opcodes import VERSION
from webmap.scene.wire.session import SceneSession

pytestmark = pytest.mark.browser


@pytest.fixture
def opened(host, tab):
    """A page with a map and a robot that has been drawn."""

    def build(shown):
        shown.root, shown.world, shown.mount = shown.add_map()
        shown.robot, shown.inner = shown.add_robot(shown.world, shown.mount)
        shown.session.view(shown.root.id, "scale", 10)
        shown.document.bind("label").text = "there"

    host.build = build
    tab.goto(host.url + "?x=1")
    tab.wait_for_selector(".robot circle")
    return host.one


def view(tab):
    return tab.evaluate(
        """async () => {
          const { page } = await import("/_webmap/web/page.js");
          return Object.values(page.scene.maps[0].view);
        }"""
    )


def newest(host, name):
    """Return a field of the newest view report, or ``None`` without a report."""
    reports = host.events(ViewReport)
    return getattr(reports[-1], name) if reports else None


def drag(tab, x):
    tab.evaluate(
        """async (x) => {
          const [map] = (await import("/_webmap/web/page.js")).page.scene.maps;
          map.setView({ ...map.view, e: map.view.e + x });
        }""",
        x,
    )


def test_a_page_sends_its_url_its_size_and_its_theme_in_its_hello(host, tab, opened):
    (hello,) = opened.hellos
    assert hello.url == "/?x=1"
    assert (hello.width, hello.height, hello.dpr) == (800, 600, 1)
    assert hello.containers["map"] == (700, 500)
    assert hello.theme == "light"


def test_a_page_under_a_prefix_sends_its_url_without_the_prefix(host, tab):
    tab.goto(f"{host.url}under/prefix/")
    wait_for(lambda: host.shown and host.one.hellos, page=tab)
    assert host.one.hellos[0].url == "/"


MANY = 300

ADD_MANY = f"""
document.addEventListener("readystatechange", () => {{
  for (let n = 0; n < {MANY}; n++) {{
    const box = document.createElement("p");
    box.id = `${{n}} ${{"é".repeat(50)}}`;
    box.textContent = "x";
    document.body.append(box);
  }}
}}, {{ once: true }});
"""


def test_the_address_of_the_socket_is_not_too_long_with_the_sizes_of_many_elements(
    host, tab
):
    addresses = []
    tab.on("websocket", lambda socket: addresses.append(socket.url))
    tab.add_init_script(ADD_MANY)
    tab.goto(f"{host.url}?x={'%22' * 1000}")
    wait_for(lambda: host.shown and host.one.hellos and addresses, page=tab)
    sizes = host.one.hellos[0].containers
    assert 2 < len(sizes) < MANY
    assert sizes["map"] == (700, 500)
    assert len(addresses[0]) < 6000


def test_the_first_picture_waits_for_no_animation_frame_and_modules_wait_for_one(
    host, tab
):
    def build(shown):
        shown.root, shown.world, shown.mount = shown.add_map()
        shown.add_robot(shown.world, shown.mount)
        shown.session.attach(shown.root.id, 5, "test.js", {}, "half.css")

    asked = []
    tab.on("request", lambda request: asked.append(request.url.rpartition("/")[2]))
    tab.add_init_script(
        """
        const asked = [];
        const animate = requestAnimationFrame;
        globalThis.requestAnimationFrame = (fn) => asked.push(fn);
        globalThis.goOn = () => {
          globalThis.requestAnimationFrame = animate;
          for (const fn of asked) animate(fn);
        };
        """
    )
    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector(".robot circle", state="attached")
    tab.wait_for_timeout(300)
    assert not {"test.js", "half.css"} & set(asked)
    tab.evaluate("goOn()")
    tab.wait_for_selector(".overlay > .half", state="attached")
    assert {"test.js", "half.css"} <= set(asked)


def test_style_sheets_that_load_together_are_read_once(host, tab, opened):
    times = tab.evaluate(
        """async () => {
          const { page } = await import("/_webmap/web/page.js");
          const { scene } = page;
          let times = 0;
          scene.restyle = () => (times += 1);
          const add = (name) => page.parts._addStyle(name, true).link;
          const sheets = ["a", "b", "c"].map(add);
          for (const sheet of sheets) sheet.dispatchEvent(new Event("load"));
          await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
          return times;
        }"""
    )
    assert times == 1


def test_the_page_shows_a_lost_link_and_reconnects(host, tab, opened):
    # The page records the text, as it may be connected again before the test looks.
    tab.evaluate(
        """() => {
          window.shownStatus = "";
          new MutationObserver(() => {
            const status = document.querySelector("html.disconnected [role=status]");
            if (status) window.shownStatus = status.textContent;
          }).observe(document, { attributes: true, childList: true, subtree: true });
        }"""
    )
    host.drop()
    assert "restarting" in wait(tab, "window.shownStatus")
    wait(tab, "!document.documentElement.classList.contains('disconnected')")
    tab.wait_for_selector("[role=status]", state="detached")
    assert len(host.shown) == 1
    assert len(opened.hellos) == 2
    assert tab.locator(".robot").count() == 1
    host.call(opened.robot.set_pose, 1, 2, 0)
    wait(tab, "document.querySelector('.robot').transform.baseVal.length")


def test_a_page_that_is_connected_again_shows_why_it_was_not(host, tab, opened):
    host.drop()
    tab.wait_for_selector("[role=status]:has-text('Before: restarting')")
    assert "Connected again" in tab.inner_text("[role=status]")
    tab.wait_for_selector("[role=status]", state="detached")


def test_a_page_that_was_hidden_soon_replaces_a_connection_that_was_lost(
    host, tab, opened
):
    hide = "Object.defineProperty(document, 'hidden', {value: %s, configurable: true})"
    tab.evaluate(hide % "true")
    before = opened.frames
    wait_for(lambda: opened.frames > before + 1, page=tab)
    host.silent = True
    tab.wait_for_timeout(500)
    tab.evaluate(hide % "false")
    # Sooner than a page that is visible all the time, which waits for 10 s.
    wait_for(lambda: len(opened.hellos) == 2, page=tab)
    host.silent = False


def test_the_view_is_kept_after_a_lost_link(host, tab, opened):
    drag(tab, 33)
    before = view(tab)
    host.drop()
    wait_for(lambda: len(opened.hellos) == 2, page=tab)
    tab.wait_for_selector(".robot circle")
    wait(tab, "!document.documentElement.classList.contains('disconnected')")
    assert view(tab) == before
    # An operation of the program is applied once, even if it is sent repeatedly.
    host.call(opened.session.view, opened.root.id, "translate", 0, 5)
    wait_for(lambda: newest(host, "applied") == 2, page=tab)
    assert view(tab)[5] == pytest.approx(before[5] + 5)


def test_the_view_and_the_map_are_kept_after_a_reload(host, tab, opened):
    drag(tab, 33)
    before = view(tab)
    wait_for(lambda: newest(host, "e") == before[4], page=tab)
    host.call(opened.session.set_class, opened.inner, "selected", True)
    tab.reload()
    tab.wait_for_selector(".robot.selected circle")
    assert len(host.shown) == 1
    assert view(tab) == pytest.approx(before)
    assert tab.inner_text("#label") == "there"


def test_another_tab_is_another_page(host, tab, opened):
    other = tab.context.new_page()
    other.goto(host.url)
    other.wait_for_selector(".robot circle")
    assert len(host.shown) == 2


def test_a_tab_opened_by_a_page_is_another_page(host, tab, opened):
    # The new tab gets a copy of the session storage, like a duplicated tab.
    with tab.expect_popup() as popup:
        tab.evaluate("void window.open(location.href)")
    popup.value.wait_for_selector(".robot circle")
    assert len(host.shown) == 2


def test_the_page_shows_that_the_display_sends_no_data(host, tab, opened):
    host.silent = True
    tab.wait_for_selector("html.disconnected", state="attached", timeout=6000)
    assert "No data from WebMap" in tab.inner_text("[role=status]")
    host.silent = False
    wait(tab, "!document.documentElement.classList.contains('disconnected')")
    assert len(opened.hellos) == 1


def test_a_refused_page_shows_the_reason_and_asks_for_a_reload(host, tab):
    host.refuse = (1008, "there is no page at this address")
    tab.goto(host.url)
    tab.wait_for_selector("[role=status]:has-text('no page at this address')")
    assert "Reload" in tab.inner_text("[role=status]")


def frame_of(record: bytes) -> bytes:
    return VERSION.to_bytes(2, "little") + bytes(13) + record


def test_an_unknown_record_is_reported_and_the_scene_is_sent_again(host, tab, opened):
    frames = opened.frames
    host.send(frame_of(b"\xfa"))
    tab.wait_for_selector("[role=alert]:has-text('cannot read a message')")
    wait_for(lambda: "250" in str(host.events(Trouble)), page=tab)
    wait_for(lambda: opened.frames > frames, page=tab)
    host.call(opened.robot.set_pose, 1, 2, 0)
    wait(tab, "document.querySelector('.robot').transform.baseVal.length")


def test_a_page_of_another_version_asks_for_a_reload(host, tab, opened):
    host.send(b"\0\0" + bytes(13))
    tab.wait_for_selector("[role=alert]:has-text('version')")
    tab.wait_for_selector("[role=status]:has-text('Reload')")
    hellos = len(opened.hellos)
    tab.wait_for_timeout(600)
    assert len(opened.hellos) == hellos


@pytest.mark.parametrize("garbage", [b"", b"\1", frame_of(b"\x25\1\xff")])
def test_an_invalid_frame_does_not_break_the_page(host, tab, opened, garbage):
    host.send(garbage)
    tab.wait_for_selector("[role=alert]")
    host.call(opened.robot.set_pose, 1, 2, 0)
    wait(tab, "document.querySelector('.robot')?.transform.baseVal.length")


def test_at_most_two_frames_are_sent_without_an_acknowledgement(host, tab, opened):
    tab.evaluate(
        """async () => {
          const { page } = await import("/_webmap/web/page.js");
          page.send = () => {};
        }"""
    )
    tab.wait_for_timeout(100)
    before = opened.frames
    for x in range(10):
        host.call(opened.robot.set_pose, x, 0, 0)
        tab.wait_for_timeout(40)
    assert opened.frames - before <= SceneSession.WINDOW
