"""The scene on a page, in a real Chromium."""

import math
import struct

import pytest

from equipment.scene_host import wait
from equipment.waiting import wait_for
from webmap.base.geometry import Affine
from webmap.scene import html, svg
from webmap.scene.node import Fragment
from webmap.scene.wire.messages import ElementEvent, Trouble

pytestmark = pytest.mark.browser

PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55"
    "0000000a49444154789c6360000000020001e221bc330000000049454e44ae426082"
)
"""A PNG of one black pixel."""


def matrix(tab, selector):
    """Return the matrix of an element relative to its parent."""
    return tab.evaluate(
        """(selector) => {
          const element = document.querySelector(selector);
          const matrices = Array.from(element.transform.baseVal, (t) => t.matrix);
          const start = new DOMMatrix();
          const m = matrices.reduce((all, one) => all.multiply(one), start);
          return [m.a, m.b, m.c, m.d, m.e, m.f];
        }""",
        selector,
    )


def test_a_robot_is_drawn_at_the_pose_that_python_sets(host, tab):
    def build(shown):
        _, world, mount = shown.add_map()
        shown.robot, _ = shown.add_robot(world, mount)
        shown.robot.set_pose(1.5, -2, math.pi / 2)

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector("#map > svg.webmap > g.world > g.robot > circle")
    assert matrix(tab, ".robot") == pytest.approx([0, 1, -1, 0, 1.5, -2], abs=1e-6)
    host.call(host.one.robot.set_pose, 500_000.125, 7, 0)
    wait(tab, "document.querySelector('.robot').transform.baseVal[0].matrix.f === 7")
    assert matrix(tab, ".robot") == pytest.approx([1, 0, 0, 1, 500_000.125, 7])
    host.call(host.one.robot.set_matrix, Affine(2, 0, 0, 2, 3, 4))
    wait(tab, "document.querySelector('.robot').transform.baseVal[0].matrix.f === 4")
    host.call(host.one.robot.set, transform="translate(8 9)")
    tab.wait_for_selector("[transform='translate(8 9)']")
    host.call(host.one.robot.set_pose, 1, 2, 0)
    wait(tab, "document.querySelector('.robot').transform.baseVal[0].matrix.f === 2")
    assert (
        tab.evaluate("document.querySelector('.robot').transform.baseVal.length") == 1
    )


def test_html_tags_in_a_text_are_shown_as_text(host, tab):
    evil = "<img src=x onerror=alert(1)>"

    def build(shown):
        shown.document.bind("label").text = evil
        shown.document.bind("log").append(html.p(evil, title=evil))
        root, _, _ = shown.add_map()
        root.append(svg.title(evil))

    host.build = build
    tab.goto(host.url)
    wait(tab, "document.querySelector('#label').textContent.startsWith('<')")
    assert tab.inner_text("#label") == evil
    assert tab.inner_text("#log > p") == evil
    assert tab.locator("img").count() == 0


def test_elements_of_the_users_html_are_filled_and_restored(host, tab):
    def build(shown):
        label = shown.document.bind("label")
        label.set(title="hello").classes.add("on")
        shown.document.bind("log").append(html.strong("one"))
        shown.document.bind("log").prepend("two ")

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector("#label.on.own[title=hello]")
    assert tab.inner_text("#label") == "old"
    assert tab.inner_text("#log") == "own texttwo one"
    host.call(lambda: setattr(host.one.document.bind("log"), "text", "new"))
    wait(tab, "document.querySelector('#log').textContent === 'new'")
    host.call(lambda: host.one.document.bind("label").remove())
    tab.wait_for_selector("#label:not(.on):not([title])")
    host.call(lambda: host.one.session.unmount(host.one.page))
    wait(tab, "document.querySelector('#log').textContent === ''")


def test_an_id_missing_in_the_page_is_shown_and_reported(host, tab):
    def build(shown):
        shown.document.bind("nowhere").text = "lost"
        shown.document.bind("label").text = "found"

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector("#label:text('found')")
    assert "nowhere" in tab.inner_text("[role=alert]")
    (trouble,) = wait_for(lambda: host.events(Trouble), page=tab)
    assert "nowhere" in trouble.text


def test_image_urls_get_the_prefix_and_urls_of_other_servers_are_refused(host, tab):
    def build(shown):
        shown.root, _, _ = shown.add_map()
        shown.image = svg.image(href="/_webmap/images/x.png")
        shown.root.append(shown.image)
        # The allow-list in Python would refuse this URL.
        shown.bad = svg.image()
        shown.bad._attributes["href"] = "https://evil.example/x.png"
        shown.root.append(shown.bad)

    host.build = build
    tab.goto(f"{host.url}under/prefix/")
    tab.wait_for_selector("image[href]", state="attached")
    prefix = f"{host.url}under/prefix/_webmap/"
    assert tab.get_attribute("image[href]", "href") == f"{prefix}images/x.png"
    assert tab.locator("image:not([href])").count() == 1
    wait_for(lambda: "evil" in str(host.events(Trouble)), page=tab)


def test_a_fast_changing_image_skips_to_the_newest_url_after_each_load(host, tab):
    def build(shown):
        shown.root, _, _ = shown.add_map()
        shown.image = svg.image(href="/_webmap/images/1.png")
        shown.root.append(shown.image)

    def shows(number):
        wait(
            tab,
            "document.querySelector('image').getAttribute('href')"
            f".endsWith('/{number}.png')",
        )

    host.build = build
    asked = []
    tab.route("**/_webmap/images/*", lambda route: asked.append(route))
    tab.goto(host.url)
    wait_for(lambda: len(asked) == 1, page=tab)
    for number in 2, 3, 4:
        host.call(host.one.image.set, href=f"/_webmap/images/{number}.png")
        host.call(host.one.root.set, data_at=str(number))
        tab.wait_for_selector(f"svg[data-at='{number}']")
    shows(1)
    asked[0].fulfill(body=PIXEL, content_type="image/png")
    shows(4)
    wait_for(lambda: len(asked) == 2, page=tab)
    asked[1].fulfill(body="no image", content_type="image/png")
    host.call(host.one.image.set, href="/_webmap/images/5.png")
    shows(5)  # a file that is not an image blocks nothing
    wait_for(lambda: len(asked) == 3, page=tab)
    host.call(host.one.image.unset, "href")
    tab.wait_for_selector("image:not([href])", state="attached")
    asked[2].fulfill(body=PIXEL, content_type="image/png")
    assert [address.request.url.rsplit("/", 1)[1] for address in asked] == [
        "1.png",
        "4.png",
        "5.png",
    ]


def test_dots_are_squares_of_the_size_in_the_style(host, tab):
    points = struct.pack("<4h", 1000, 2000, -1000, 0)

    def build(shown):
        _, world, mount = shown.add_map()
        shown.robot, _ = shown.add_robot(world, mount)
        shown.dots = svg.path(class_="dot")
        shown.dots.set_dots(points, 0.001)
        shown.robot.append(svg.g(shown.dots, class_="laserscan"))

    host.build = build
    tab.goto(host.url)
    square = "h60v60h-60"
    tab.wait_for_selector(
        f"path[d='M970 1970{square}M-1030 -30{square}']", state="attached"
    )
    assert matrix(tab, ".dot") == pytest.approx([0.001, 0, 0, 0.001, 0, 0])
    style = "getComputedStyle(document.querySelector('.dot')).shapeRendering"
    assert tab.evaluate(style) == "crispedges"
    # The size follows the style, without new points.
    host.call(host.one.robot.classes.add, "thick")
    tab.wait_for_selector("path[d^='M900 1900h200v200h-200']", state="attached")
    # The dots have both a unit and their own pose.
    host.call(host.one.dots.set_pose, 3, 4, 0)
    host.call(host.one.dots.set_dots, points, 0.01)
    tab.wait_for_selector("path[d^='M990 1990h20v20h-20']", state="attached")
    assert matrix(tab, ".dot") == pytest.approx([0.01, 0, 0, 0.01, 3, 4])


def test_new_elements_with_classes_do_not_make_the_page_read_the_size_of_dots(
    host, tab
):
    def build(shown):
        _, world, mount = shown.add_map()
        shown.robot, _ = shown.add_robot(world, mount)
        dots = svg.path(class_="dot")
        dots.set_dots(struct.pack("<2h", 0, 0), 0.001)
        shown.robot.append(dots)

    host.build = build
    tab.add_init_script(
        """globalThis.read = 0;
        const { getPropertyValue } = CSSStyleDeclaration.prototype;
        CSSStyleDeclaration.prototype.getPropertyValue = function (name) {
          globalThis.read += name === "--dot-size";
          return getPropertyValue.call(this, name);
        };"""
    )
    tab.goto(host.url)
    tab.wait_for_selector(".dot[d]", state="attached")
    tab.wait_for_timeout(500)
    before = tab.evaluate("read")
    for number in range(3):
        host.call(host.one.robot.append, svg.circle(class_=f"new n{number}"))
        tab.wait_for_selector(f".n{number}", state="attached")
    assert tab.evaluate("read") == before
    host.call(host.one.robot.classes.add, "thick")
    wait(tab, f"read === {before + 1}")


def test_a_page_has_no_dots_of_a_layer_that_it_does_not_show(host, tab):
    points = struct.pack("<4h", 1000, 2000, -1000, 0)

    def build(shown):
        _, world, mount = shown.add_map()
        shown.robot, _ = shown.add_robot(world, mount)
        shown.dots = svg.path(class_="dot")
        shown.dots.set_dots(points, 0.001)
        shown.robot.append(svg.g(shown.dots, class_="laserscan"))

    host.build = build
    tab.goto(host.url)
    drawn = "document.querySelector('.dot')?.getAttribute('d')"
    display = "document.querySelector('.laserscan').style.display"
    wait(tab, f"({drawn} ?? '').length > 10")
    for _ in range(2):
        tab.evaluate(f"{display} = 'none'")
        wait(tab, f"{drawn} === ''")
        host.call(host.one.dots.set_dots, points + points, 0.001)
        tab.wait_for_timeout(300)
        assert tab.evaluate(drawn) == ""
        tab.evaluate(f"{display} = ''")
        wait(tab, f"{drawn}.split('M').length === 5")
        host.call(host.one.dots.set_dots, points, 0.001)
        wait(tab, f"{drawn}.split('M').length === 3")


def test_the_page_increases_ages_without_new_data(host, tab):
    def build(shown):
        _, world, mount = shown.add_map()
        shown.robot, _ = shown.add_robot(world, mount)
        shown.robot.set_age(0.2, limit=3)
        shown.document.bind("label").append(html.span(class_="age"))
        shown.span = shown.document.bind("label").children[0]
        shown.span.set_age(math.inf, age_text=True)

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector(".robot:not(.stale)")
    tab.wait_for_selector(".age.stale:text('no data')")
    tab.wait_for_selector(".robot.stale", timeout=10_000)
    assert float(tab.get_attribute(".robot", "data-age")) >= 3
    host.call(host.one.robot.set_age, 0)
    tab.wait_for_selector(".robot:not(.stale)")
    tab.evaluate("() => { before = document.querySelector('.age').firstChild; }")
    host.call(host.one.span.set_age, 75)
    # The page may show the age late; it then increases the shown age.
    tab.wait_for_selector(".age.stale:text-matches('^7[5-9] s$')")
    seconds = tab.inner_text(".age").removesuffix(" s")
    wait(tab, f"parseInt(document.querySelector('.age').textContent) > {seconds}")
    # Another text node would make the browser evaluate every :has() again.
    assert tab.evaluate("before === document.querySelector('.age').firstChild")


def test_the_page_increases_ages_while_the_server_is_gone(host, tab):
    tab.allowed = ["ERR_CONNECTION_REFUSED", "WebSocket connection"]

    def build(shown):
        _, world, mount = shown.add_map()
        shown.robot, _ = shown.add_robot(world, mount)
        shown.robot.set_age(0, limit=3)

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector(".robot:not(.stale)")
    host.__exit__()
    tab.wait_for_selector("html.disconnected .robot.stale", timeout=15_000)
    assert "No connection" in tab.inner_text("[role=status]")
    before = float(tab.get_attribute(".robot", "data-age"))
    wait(
        tab,
        f"document.querySelector('.robot').dataset.age > {before} + 0.4",
    )


def test_a_class_of_a_mount_does_not_change_the_shared_element(host, tab):
    def build(shown):
        _, world, mount = shown.add_map()
        shown.robot, shown.robot_mount = shown.add_robot(world, mount)
        shown.session.set_class(shown.robot_mount, "selected", True)

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector(".robot.selected")
    host.call(host.one.robot.classes.add, "fast")
    tab.wait_for_selector(".robot.selected.fast")
    assert "selected" not in host.one.robot.classes
    host.call(host.one.session.set_class, host.one.robot_mount, "selected", False)
    tab.wait_for_selector(".robot.fast:not(.selected)")


def test_mounts_are_sorted_by_order_before_and_after_own_children(host, tab):
    def build(shown):
        _, world, mount = shown.add_map()
        world.append(svg.g(id="own"))
        for order in (2, -1, 1, -2, 1):
            shown.add_robot(world, mount, name=f"o{order}", order=order)
        world.append(svg.g(id="own2"))
        world.prepend(svg.g(id="own0"))

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector("[data-robot=o2]")
    order = """[...document.querySelectorAll('.world > g')].map(
      (g) => g.dataset.robot ?? g.id)"""
    own = ["own0", "own", "own2"]
    assert tab.evaluate(order) == ["o-2", "o-1", *own, "o1", "o1", "o2"]
    shown = host.one
    world = shown.session._mounts[2].fragment.root.children[0]
    host.call(lambda: world.insert(1, svg.g(id="later")))
    tab.wait_for_selector("#later", state="attached")
    own.insert(1, "later")
    assert tab.evaluate(order) == ["o-2", "o-1", *own, "o1", "o1", "o2"]


def test_one_fragment_is_shown_on_two_maps(host, tab):
    def build(shown):
        shown.robot = svg.g(class_="robot")
        fragment = Fragment(shown.robot)
        for container in ("map", "log"):
            _, world, mount = shown.add_map(300, 200, container)
            shown.session.mount(fragment, under=world.id, within=mount)

    host.build = build
    tab.goto(host.url)
    wait(tab, "document.querySelectorAll('.robot').length === 2")
    host.call(lambda: host.one.robot.append(svg.circle(r=1)))
    host.call(host.one.robot.set_pose, 5, 6, 0)
    wait(tab, "document.querySelectorAll('.robot circle').length === 2")
    wait(tab, "document.querySelector('.robot').transform.baseVal.length")
    for place in ("#map", "#log"):
        assert matrix(tab, f"{place} .robot") == [1, 0, 0, 1, 5, 6]


def test_a_click_event_contains_its_world_coordinates(host, tab):
    def build(shown):
        shown.root, world, mount = shown.add_map()
        shown.robot, inner = shown.add_robot(world, mount)
        shown.session.view(shown.root.id, "scale", 10)
        shown.root.on("click", print)
        shown.session.listen(inner, shown.robot.id, "click", stop=True)

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector(".robot circle")
    tab.mouse.click(10 + 350 + 20, 5 + 250 - 10)
    (event,) = wait_for(lambda: host.events(ElementEvent), page=tab)
    assert event.element == host.one.robot.id
    assert (event.x, event.y) == pytest.approx((370, 240))
    assert (event.world_x, event.world_y) == pytest.approx((2, 1))
    tab.mouse.click(10 + 350 + 200, 5 + 250 - 100, button="left")
    wait_for(lambda: len(host.events(ElementEvent)) == 2, page=tab)
    missed = host.events(ElementEvent)[1]
    assert missed.element == host.one.root.id
    assert (missed.world_x, missed.world_y) == pytest.approx((20, 10))


def test_click_coordinates_on_a_framed_map_start_inside_the_frame(host, tab):
    def build(shown):
        shown.root, _, _ = shown.add_map(400, 300)
        shown.root.classes.add("framed")
        shown.root.on("click", print)

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector(".framed")
    tab.mouse.click(10 + 5 + 100, 5 + 5 + 50)
    (event,) = wait_for(lambda: host.events(ElementEvent), page=tab)
    assert (event.x, event.y) == pytest.approx((100, 50))
    assert (event.world_x, event.world_y) == pytest.approx((-100, 100))


def test_input_and_key_events_contain_the_value_the_checked_state_and_the_key(
    host, tab
):
    def build(shown):
        shown.box = html.input(type="checkbox", id="box")
        shown.field = html.input(type="text", id="field", value="a")
        shown.document.bind("label").append(shown.box, shown.field)
        shown.box.on("change", print)
        shown.field.on("input", print)
        shown.field.on("keydown", print, prevent=True)

    host.build = build
    tab.goto(host.url)
    tab.check("#box")
    tab.focus("#field")
    tab.keyboard.press("Shift+X")
    tab.fill("#field", "typed")
    wait_for(lambda: len(host.events(ElementEvent)) == 4, page=tab)
    change, shift, key, typed = host.events(ElementEvent)
    assert (change.event, change.checked) == ("change", True)
    assert (shift.key, key.key, key.shift) == ("Shift", "X", True)
    # The default action of the key was prevented.
    assert (typed.event, typed.value) == ("input", "typed")
    # After a person unticked the box, Python can tick it again.
    host.call(host.one.box.set, checked=True)
    tab.wait_for_selector("#box[checked]")
    tab.uncheck("#box")
    host.call(host.one.box.set, checked=True)
    wait(tab, "document.querySelector('#box').checked")
    host.call(host.one.field.set, value="python")
    wait(tab, "document.querySelector('#field').value === 'python'")


def test_the_page_sends_no_event_after_the_listener_was_removed(host, tab):
    def build(shown):
        shown.button = html.button("Go", id="go")
        shown.removal = shown.button.on("click", print)
        shown.document.bind("label").append(shown.button)

    host.build = build
    tab.goto(host.url)
    tab.click("#go")
    wait_for(lambda: host.events(ElementEvent), page=tab)
    # The title in the same frame shows that the page has received the removal.
    host.call(lambda: (host.one.removal.remove(), host.one.button.set(title="deaf")))
    tab.wait_for_selector("#go[title=deaf]")
    tab.evaluate(
        """async () => {
          const { page } = await import("/_webmap/web/page.js");
          const send = page.send.bind(page);
          window.sent = [];
          page.send = (message) => { window.sent.push(message.op); send(message); };
        }"""
    )
    tab.click("#go")
    tab.wait_for_timeout(100)
    sent = tab.evaluate("window.sent")
    assert "event" not in sent


def test_a_thousand_added_and_removed_robots_leave_nothing_in_the_page(host, tab):
    def build(shown):
        shown.root, shown.world, shown.mount = shown.add_map()

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector(".world", state="attached")
    shown = host.one

    def come_and_go():
        for _ in range(50):
            robot, mount = shown.add_robot(shown.world, shown.mount)
            robot.set_age(0)
            robot.append(svg.path(class_="dot"))
            robot.children[1].set_dots(bytes(4), 0.001)
            robot.on("click", print)
            shown.coming.append(mount)

    def go():
        for mount in shown.coming:
            shown.session.unmount(mount)
        shown.coming = []

    shown.coming = []
    for _ in range(20):
        host.call(come_and_go)
        wait(tab, "document.querySelectorAll('.robot').length === 50")
        host.call(go)
        wait(tab, "document.querySelectorAll('.robot').length === 0")
    left = tab.evaluate(
        """async () => {
          const { scene } = (await import("/_webmap/web/page.js")).page;
          return [scene._mounts.size, scene._fragments.size, scene._ages._ages.size,
            scene._dots._all.size, document.querySelectorAll("svg *").length];
        }"""
    )
    assert left == [2, 2, 0, 0, 1]
