import gc
import math
import weakref

import pytest

from webmap.base.errors import SceneError
from webmap.base.geometry import Affine
from webmap.base.scope import Scope, current_scope
from webmap.scene import html, svg
from webmap.scene.element import Event
from webmap.scene.node import Fragment, Text


def test_keyword_arguments_become_attributes():
    circle = svg.circle(r=0.2, class_="a b", stroke_width=2, viewBox=None)
    assert circle.get("r") == "0.2"
    assert circle.get("stroke-width") == circle.get("stroke_width") == "2"
    assert list(circle.classes) == ["a", "b"]
    assert circle.get("class") == "a b"
    assert circle.get("viewBox") is None


def test_attributes_with_hyphens_are_set_by_name():
    g = svg.g().set("data-name", "Bob").set("aria-label", "Robot Bob")
    assert g.get("data-name") == "Bob"
    assert g.get("aria_label") == "Robot Bob"
    assert g.unset("data-name").get("data-name") is None


def test_classes_are_added_removed_and_toggled():
    g = svg.g(class_="robot")
    g.classes.add("fast", "red")
    g.classes.remove("fast", "never-there")
    assert "red" in g.classes
    assert g.classes.toggle("red") is False
    assert g.classes.toggle("red", on=True) is True
    assert str(g.classes) == "robot red"
    with pytest.raises(SceneError, match="word"):
        g.classes.add("")


def test_setting_the_text_replaces_all_children():
    p = html.p("Hello ", html.strong("you"))
    assert p.text == "Hello you"
    p.text = "<b>bye</b>"
    assert p.text == "<b>bye</b>"
    assert [type(node) for node in p.children] == [Text]


def test_setting_the_text_again_reuses_the_text_node():
    p = html.p(text="1")
    node = p.children[0]
    p.text = "2"
    assert p.children == (node,)


def test_children_are_kept_in_order():
    a, b, c = svg.g(), svg.g(), svg.g()
    parent = svg.g(b)
    parent.append(c).insert(0, a)
    assert parent.children == (a, b, c)
    parent.insert(3, a)
    assert parent.children == (b, c, a)
    parent.prepend(c, a)
    assert parent.children == (c, a, b)
    assert c.parent is parent


def test_a_child_appended_to_a_new_parent_leaves_its_old_parent():
    child = svg.g()
    old, new = svg.g(child), svg.g()
    new.append(child)
    assert old.children == ()
    assert child.parent is new


def test_an_element_cannot_contain_itself():
    inner = svg.g()
    outer = svg.g(inner)
    with pytest.raises(SceneError, match="itself"):
        inner.append(outer)
    with pytest.raises(SceneError, match="itself"):
        inner.append(inner)


def test_the_root_of_a_fragment_cannot_be_appended_or_reused():
    root = svg.g()
    Fragment(root)
    with pytest.raises(SceneError, match="mount"):
        svg.g().append(root)
    with pytest.raises(SceneError, match="already"):
        Fragment(root)


def test_only_elements_and_text_can_be_children():
    with pytest.raises(SceneError, match="element or text"):
        svg.g().append(5)


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_a_pose_or_matrix_must_be_finite(number):
    g = svg.g()
    for pose in ((number, 0, 0), (0, number, 0), (0, 0, number)):
        with pytest.raises(SceneError, match="finite"):
            g.set_pose(*pose)
    with pytest.raises(SceneError, match="finite"):
        g.set_matrix(Affine(a=number))


def test_an_html_element_cannot_have_a_pose():
    with pytest.raises(SceneError, match="not SVG"):
        html.p().set_pose(1, 2, 3)


def test_dots_need_a_path_whole_points_and_a_unit():
    svg.path().set_dots(b"\0\0\0\0", 0.001)
    with pytest.raises(SceneError, match="not a path"):
        svg.circle().set_dots(b"", 0.001)
    with pytest.raises(SceneError, match="4 bytes"):
        svg.path().set_dots(b"123", 0.001)
    with pytest.raises(SceneError, match="unit"):
        svg.path().set_dots(b"", 0)


@pytest.mark.parametrize("number", [math.nan, math.inf, 1e39])
def test_a_line_must_be_of_finite_numbers_and_stays_as_it_was(number):
    line = svg.polyline().set_line([(0, 0), (1.234, -2)])
    with pytest.raises(SceneError, match="finite"):
        line.set_line([(5, 6), (7, number)])
    with pytest.raises(SceneError, match="finite"):
        line.extend_line([(number, 6)], drop=1)
    with pytest.raises(SceneError, match="drop"):
        line.extend_line([], drop=-1)
    assert line.get("points") == line.attributes["points"] == "0,0 1.234,-2"


def test_only_a_polyline_or_polygon_can_be_a_line():
    svg.polygon().set_line([(0, 0)])
    for other in (svg.path(), html.p()):
        with pytest.raises(SceneError, match="not a polyline"):
            other.set_line([(0, 0)])


def test_a_line_that_stays_the_same_is_not_sent_again():
    line = svg.polyline().set_line([(0, 0), (1.234, -2)])
    fragment = Fragment(line)
    line.set_line([(0, 0), (1.234, -2)]).extend_line([])
    assert fragment.revision == 0


@pytest.mark.parametrize("age", [-1, math.nan])
def test_an_age_and_its_limit_must_not_be_negative_or_nan(age):
    with pytest.raises(SceneError, match="age"):
        svg.g().set_age(age)
    with pytest.raises(SceneError, match="limit"):
        svg.g().set_age(0, limit=age)


def test_an_event_reaches_every_handler_even_if_one_raises():
    received, errors = [], []
    button = html.button("Go")

    def broken(event):
        raise RuntimeError("no")

    button.on("click", broken)
    button.on("click", received.append)
    event = Event(kind="click", element=button)
    button.dispatch(event, errors.append)
    assert received == [event]
    assert [str(error) for error in errors] == ["no"]
    assert button.handlers("click") == (broken, received.append)


def test_a_handler_runs_in_the_scope_of_its_registration():
    scope, seen = Scope("page"), []
    button = html.button()
    with scope.active():
        button.on("click", lambda event: seen.append(current_scope()))
    button.on("click", lambda event: seen.append(current_scope()))
    with Scope("other").active():
        button.dispatch(Event(kind="click"), pytest.fail)
    assert seen == [scope, None]


def test_the_coroutine_of_an_async_handler_is_passed_on():
    async def handler(event):
        return event.kind

    spawned = []
    button = html.button()
    button.on("click", handler)
    button.dispatch(Event(kind="click"), pytest.fail, spawned.append)
    with pytest.raises(StopIteration, match="click"):
        spawned[0].send(None)


def test_closing_a_scope_removes_its_handlers():
    scope = Scope()
    button = html.button()
    with scope.active():
        button.on("click", print, stop=True)
    assert button.listening == {"click": (False, True)}
    scope.close()
    assert button.listening == {}


def test_a_removed_element_leaves_nothing_in_its_scope():
    scope = Scope()
    parent = html.ul()
    Fragment(parent)
    with scope.active():
        for _ in range(1000):
            item = html.li(html.button("x"))
            item.children[0].on("click", print)
            parent.append(item)
            item.remove()
        removal = html.button().on("click", print)
        removal.remove()
    assert len(scope) == 0
    assert parent.fragment is not None
    assert len(parent.fragment) == 1
    left = weakref.ref(item)
    del item
    gc.collect()
    assert left() is None


def test_removing_an_element_twice_is_harmless():
    child = svg.g()
    parent = svg.g(child)
    child.remove()
    child.remove()
    assert parent.children == ()
