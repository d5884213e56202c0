import pytest

from webmap.base.errors import SceneError
from webmap.scene import html, svg
from webmap.scene.document import Document
from webmap.scene.node import Changed, Fragment


def test_binding_the_same_id_twice_gives_the_same_element():
    document = Document()
    Fragment(document)
    log = document.bind("log")
    assert document.bind("log") is log
    assert log.html_id == "log"
    assert document.bind("other") is not log


def test_setting_the_text_clears_the_content_of_the_page_element():
    document = Document()
    fragment = Fragment(document)
    label = document.bind("label")
    since = fragment.revision
    label.text = "Bob"
    assert Changed(label, "emptied") in fragment.changes_since(since)
    assert label.text == "Bob"


def test_prepend_adds_text_at_the_beginning():
    log = Document().bind("log")
    log.prepend("first line").prepend("second line")
    assert log.text == "second linefirst line"


def test_a_bound_element_has_classes_attributes_and_events():
    element = Document().bind("x")
    element.classes.add("on")
    element.set(title="hello", aria_live="polite")
    element.on("click", print)
    assert element.get("title") == "hello"
    with pytest.raises(SceneError):
        element.set("onclick", "x")
    with pytest.raises(SceneError, match="not SVG"):
        element.set_pose(0, 0, 0)


@pytest.mark.parametrize("html_id", ["", "two words", None])
def test_an_id_must_be_a_single_word(html_id):
    with pytest.raises(SceneError, match="word"):
        Document().bind(html_id)


def test_the_document_accepts_only_bound_elements():
    document = Document()
    with pytest.raises(SceneError, match=r"page\.element"):
        document.append(html.p())
    with pytest.raises(SceneError, match=r"page\.element"):
        document.append("text")
    with pytest.raises(SceneError, match="no attributes"):
        document.set(title="x")


def test_an_svg_element_can_be_appended_to_a_bound_element():
    container = Document().bind("container")
    container.append(svg.svg())
    assert container.children[0].tag == "svg"
