import pytest

from webmap.base.errors import SceneError
from webmap.scene import html, svg
from webmap.scene.allowed import ATTRIBUTES, EVENTS, HTML_TAGS, SVG_TAGS
from webmap.scene.element import Element


def test_every_svg_tag_has_a_maker():
    makers = {item.tag for item in vars(svg).values() if isinstance(item, svg.SvgMaker)}
    assert makers == set(SVG_TAGS)


def test_every_html_tag_has_a_maker():
    makers = {
        item.tag for item in vars(html).values() if isinstance(item, html.HtmlMaker)
    }
    assert makers == set(HTML_TAGS)


@pytest.mark.parametrize("tag", ["script", "style", "iframe", "foreignObject", "set"])
@pytest.mark.parametrize("namespace", ["svg", "html"])
def test_unsafe_tags_are_refused(tag, namespace):
    with pytest.raises(SceneError, match="not allowed"):
        Element(tag, namespace=namespace)


def test_the_error_for_a_refused_tag_suggests_the_nearest_allowed_tag():
    with pytest.raises(SceneError, match="'circle'"):
        Element("cirle")


def test_the_error_for_a_refused_attribute_suggests_the_nearest_attribute():
    with pytest.raises(SceneError, match="'stroke-width'"):
        svg.circle(stroke_widht=2)


@pytest.mark.parametrize("name", ["onclick", "onload", "style", "srcdoc", "xlink:href"])
def test_unsafe_attributes_are_refused(name):
    with pytest.raises(SceneError):
        svg.g().set(name, "alert(1)")
    with pytest.raises(SceneError):
        html.div().set(name, "alert(1)")


@pytest.mark.parametrize(
    "url",
    [
        "javascript:alert(1)",
        "JaVaScript:alert(1)",
        " javascript:alert(1)",
        "java\tscript:alert(1)",
        "//evil.example/x.png",
        "/\\evil.example/x.png",
        "https://evil.example/x.png",
        "data:image/svg+xml,<svg/>",
        "\x00//evil.example",
    ],
)
@pytest.mark.parametrize("make", [svg.image, html.a])
def test_unsafe_urls_and_urls_of_another_origin_are_refused(url, make):
    with pytest.raises(SceneError):
        make(href=url)
    with pytest.raises(SceneError):
        html.img(src=url)


@pytest.mark.parametrize("url", ["map.png", "/static/map.png?v=3", "../x.png", "#top"])
def test_urls_on_this_server_are_allowed(url):
    assert html.a(href=url).get("href") == url


def test_the_use_tag_refers_only_to_elements_of_the_document():
    assert svg.use(href="#arrow").get("href") == "#arrow"
    with pytest.raises(SceneError, match="'#id'"):
        svg.use(href="other.svg#arrow")


def test_url_references_to_other_documents_are_refused():
    assert svg.rect(fill="url(#shade)").get("fill") == "url(#shade)"
    for value in ("url(http://evil.example/x)", "URL( //x )", "url(#a) url(x)"):
        with pytest.raises(SceneError, match=r"url\(#id\)"):
            svg.rect(fill=value)
        with pytest.raises(SceneError, match=r"url\(#id\)"):
            svg.rect().set_style("--picture", value)


def test_only_custom_style_properties_can_be_set():
    svg.g().set_style("--dot-size", 0.05)
    with pytest.raises(SceneError, match="--dot-size"):
        svg.g().set_style("position", "fixed")


def test_only_allowed_input_types_are_accepted():
    assert html.input(type="range").get("type") == "range"
    with pytest.raises(SceneError, match="password"):
        html.input(type="password")


def test_the_error_for_an_unknown_event_suggests_the_nearest_event():
    with pytest.raises(SceneError, match="'click'"):
        svg.g().on("clik", print)


def test_the_numbers_of_tags_attributes_and_events_fit_into_one_byte():
    assert len(ATTRIBUTES) < 255
    assert len(EVENTS) < 255
    assert len(SVG_TAGS) + len(HTML_TAGS) < 255
