"""The pictures of robots in a fleet file."""

import io

import pytest
from PIL import Image
from playwright.sync_api import expect

from equipment.console_page import shown
from equipment.waiting import wait_for
from webmap.base.errors import ConfigError
from webmap.core.pictures import pictures
from webmap.fleet.fleet_file import prepare

GOOD = """\
[bridges]
hall = "ws://hall:9090"

[[robots]]
name = "Bob"
odometry = "/odom"

[robots.picture]
file = "bob.png"
width = 2
height = 1.0
x = 0.5
angle = 90
"""
RED, BLUE = (200, 30, 30), (30, 30, 200)


@pytest.fixture
def write(tmp_path):
    picture = Image.new("RGB", (20, 10), BLUE)
    picture.paste(RED, (10, 0, 20, 10))  # its nose
    picture.save(tmp_path / "bob.png")
    (tmp_path / "cut.png").write_bytes((tmp_path / "bob.png").read_bytes()[:60])
    (tmp_path / "text.png").write_text("not a picture")
    (tmp_path / "bob.svg").write_text("<html>no</html>")
    Image.new("1", (9000, 9000)).save(tmp_path / "large.png")

    def write_(text):
        file = tmp_path / "fleet.toml"
        file.write_text(text)
        return file

    return write_


def test_the_picture_of_a_robot_has_its_position_size_and_angle(write):
    (robot,) = prepare(write(GOOD)).robots
    (image,) = [e for e in robot.svg.walk() if getattr(e, "tag", "") == "image"]
    assert image.attributes["width"] == "2"
    # The middle of its right edge is the nose, which the angle turns to the left.
    assert image._transform.apply(1.0, 0.0) == pytest.approx((0.5, 1.0))
    tag = image.attributes["href"].rpartition("/")[2]
    assert pictures.get(tag).media_type == "image/png"
    robot.destroy()


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('file = "bob.png"\n', "", 'FILE:8: robots[0].picture: the key "file" is miss'),
        ("width = 2\n", "", 'FILE:8: robots[0].picture: the key "width" is missing'),
        ("width = 2", "width = 0", "FILE:10: robots[0].picture.width: got the whole"),
        ("x = 0.5", 'x = "0.5"', "FILE:12: robots[0].picture.x: got the text"),
        ("x = 0.5", "x = inf", "expected a number of metres: how far its middle is"),
        ("angle", "angel", 'no key "angel" here; did you mean "angle"?'),
        ("bob.png", "no.png", "FILE:9: robots[0].picture.file: there is no file"),
        ("bob.png", ".", "FILE:9: robots[0].picture.file: "),
        ("bob.png", "fleet.toml", "is not a picture: its name must end in .bmp .gif"),
        ("bob.png", "text.png", "cannot be read: expected a complete picture"),
        ("bob.png", "cut.png", "FILE:9: robots[0].picture.file: "),
        ("bob.png", "bob.svg", "is not an SVG: it has no element <svg>"),
        ("bob.png", "large.png", "has 9000 x 9000 pixels; expected 67108864 at the"),
    ],
)
def test_an_invalid_picture_is_reported_with_its_line(write, old, new, expected):
    assert old in GOOD
    file = write(GOOD.replace(old, new, 1))
    with pytest.raises(ConfigError) as error:
        prepare(file)
    assert expected in str(error.value).replace(str(file), "FILE")


def test_a_picture_that_is_not_a_table_is_refused(write):
    text = GOOD.partition("\n[robots.picture]")[0] + 'picture = "bob.png"\n'
    with pytest.raises(ConfigError, match="expected a table of keys and values"):
        prepare(write(text))


@pytest.mark.browser
def test_the_page_draws_the_picture_at_the_robot(chromium, ros2, write):
    text = GOOD.replace("ws://hall:9090", ros2).replace("angle = 90", "")
    with shown(chromium, "run", str(write(text))) as page:
        image = page.locator(".robot:not(.unplaced) image.picture")
        expect(image).to_have_count(1, timeout=15_000)
        page.wait_for_function(
            "() => { const i = document.querySelector('image.picture');"
            " return fetch(i.getAttribute('href')).then((r) => r.ok); }"
        )
        wait_for(  # the view moves first
            lambda: look(page, image) == [BLUE, RED],
            lambda: f"blue and red, not {look(page, image)}",
            page=page,
        )


def look(page, image):
    """Return the colours of a picture's rear and nose; check the place of the nose."""
    rear, nose, there = image.evaluate(
        "(i) => [[i, -0.9], [i, 0.9], [i.closest('.model'), 1.4]].map(([e, x]) =>"
        " { const p = new DOMPoint(x, 0).matrixTransform(e.getScreenCTM());"
        " return [p.x, p.y]; })"
    )
    assert nose == pytest.approx(there, abs=0.01), "half a metre before the base"
    seen = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    within = [(round(u), round(v)) for u, v in (rear, nose)]
    if not all(0 <= u < seen.width and 0 <= v < seen.height for u, v in within):
        return []
    return [seen.getpixel(place) for place in within]
