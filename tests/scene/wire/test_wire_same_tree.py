"""Python and a real document hold the same tree."""

import base64
import math
from unittest.mock import ANY

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from wire_picture import f32, histories, line_of, play, texts_of

from equipment.chromium import watched_tab
from equipment.scene_host import SceneHost
from webmap.base.geometry import Affine
from webmap.scene.node import Text
from webmap.scene.wire.session import SceneSession

pytestmark = pytest.mark.browser

SHOW = """
async (frames) => {
  const { Scene } = await import("/_webmap/web/scene.js");
  const notices = [];
  const scene = new Scene({
    send() {},
    notice: (text) => notices.push(text),
    error: (text) => notices.push(text),
    problem: (number, text) => notices.push(text),
    recheckProblems() {},
    hear() {},
    drive() {},
    parts: { detachFrom() {} },
    root: document,
    body: document.body,
  });
  for (const frame of frames) {
    const bytes = Uint8Array.from(atob(frame), (c) => c.charCodeAt(0));
    scene.apply(bytes.buffer, performance.now() / 1000);
  }
  const plain = (node) => {
    if (node.nodeType === Node.TEXT_NODE) return node.data;
    const attributes = Object.fromEntries(
      Array.from(node.attributes, ({ name, value }) => [name, value]),
    );
    const { class: classes = "", style, d, transform, points, ...rest } = attributes;
    delete rest["data-age"];
    const list = Array.from(node.transform?.baseVal ?? [], (t) => t.matrix);
    const m = list.reduce((all, one) => all.multiply(one), new DOMMatrix());
    return {
      tag: node.localName,
      svg: node.namespaceURI.endsWith("svg"),
      attributes: rest,
      classes: classes.split(" ").filter((name) => name && name !== "stale").sort(),
      size: node.style.getPropertyValue("--dot-size"),
      matrix: [m.a, m.b, m.c, m.d, m.e, m.f],
      dots: (d ?? "").split("M").length - 1,
      line: Array.from(node.points ?? [], ({ x, y }) => [x, y]).flat(),
      named: points !== undefined,
      children: Array.from(node.childNodes, plain),
    };
  };
  const roots = [...scene._mounts.values()].map(({ root }) => plain(root.element));
  scene._ages.stop();
  return { roots, notices };
}
"""


def expected(node, mount=None):
    if isinstance(node, Text):
        return node.data
    transform = node._transform
    matrix = [1, 0, 0, 1, 0, 0]
    if isinstance(transform, Affine):
        matrix = list(transform.values)
    elif isinstance(transform, tuple):
        x, y, yaw = transform
        cos, sin = math.cos(yaw), math.sin(yaw)
        near = max(abs(x), abs(y)) < 4096
        matrix = [cos, sin, -sin, cos, f32(x) if near else x, f32(y) if near else y]
    elif transform == "scale(2)":
        matrix = [2, 0, 0, 2, 0, 0]
    if node._dots is not None:
        matrix[:4] = [number * f32(node._dots.unit) for number in matrix[:4]]
    return {
        "tag": node.tag,
        "svg": node.namespace == "svg",
        "attributes": {k: v for k, v in texts_of(node).items() if k != "points"},
        "classes": sorted({*node.classes, *(mount.classes if mount else ())}),
        "size": node._styles.get("--dot-size", ""),
        "matrix": pytest.approx(matrix, rel=1e-5, abs=1e-5),
        "dots": len(node._dots.points) // 4 if node._dots else 0,
        "line": line_of(node) or ([1, 2] if "points" in texts_of(node) else []),
        "named": ANY if line_of(node) == [] else "points" in node._attributes,
        "children": [expected(child) for child in node.children],
    }


@pytest.fixture(scope="module")
def blank(chromium, request):
    with SceneHost() as host, watched_tab(chromium, 800, 600) as page:
        page.goto(host.url)
        yield page


@given(histories)
@settings(
    max_examples=60,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.explicit, Phase.generate],
)
def test_a_real_document_matches_the_scene_after_any_history(blank, history):
    assert_same(blank, history)


def test_dots_keep_a_transform_set_as_text(blank):
    add = ("add", 0, 0, 0, 0.0, "")
    transform = ("transform", 0, 2, 0, 0.0, "")
    dots = ("dots", 0, 2, 0, 3.0, "")
    for then in ("frame", "look away"):
        assert_same(blank, [([add, transform], then), ([dots], then)])
        assert_same(blank, [([add, dots], then), ([transform], then)])


def test_a_line_of_numbers_and_a_text_of_points_replace_each_other(blank):
    def step(name, number):
        return (name, 0, 4, 0, number, "")

    line, longer, shorter = step("line", 3.0), step("extend", 6.5), step("extend", 2.5)
    text, unset = step("points", 1.0), step("points", -1.0)
    steps = [line, longer, shorter, text, longer, unset, longer, shorter, unset, line]
    history = [([("add", 0, 0, 0, 0.0, ""), line], "frame")]
    for each in steps:
        history.append(([each], "frame"))
        assert_same(blank, history)
        assert_same(blank, [*history[:-1], ([each, longer], "look away")])


def assert_same(blank, history):
    session = SceneSession()
    frames = [base64.b64encode(f).decode() for f in play(history, session)]
    shown = blank.evaluate(SHOW, frames)
    assert shown["notices"] == []
    mounts = list(session._mounts.values())
    assert shown["roots"] == [expected(m.fragment.root, m) for m in mounts]
