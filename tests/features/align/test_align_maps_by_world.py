"""Maps from disk, cell by cell: the cell at a place of the world is checked.

The expected value of each cell is computed here from its pixel by the rules in
map_server's documentation, and not by the code under test.
"""

import asyncio
import io
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from module_fakes import header, image_of, images, pixel
from PIL import Image
from playwright.sync_api import Browser, Page

from equipment.chromium import watched_tab
from equipment.waiting import until
from equipment.webmap_process import page_of
from webmap.base.geometry import Affine

pytestmark = pytest.mark.slow

HERE = Path(__file__).parents[1]


@dataclass(frozen=True)
class Plan:
    """A map file: a picture, its upper row first, and settings."""

    picture: tuple[tuple[int, ...], ...]
    form: str = "P5"
    resolution: float = 0.05
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    negate: bool = False
    occupied: float = 0.65
    free: float = 0.196
    mode: str = "trinary"

    @property
    def size(self) -> tuple[int, int]:
        return len(self.picture), len(self.picture[0])

    def write(self, folder: Path, name: str = "map") -> Path:
        rows = np.array(self.picture, np.uint8)
        image = folder / f"{name}.{self.form if self.form in ('png', 'bmp') else 'pgm'}"
        if image.suffix != ".pgm":
            Image.fromarray(rows).save(image)
        else:
            head = (
                f"{self.form}\n# made by hand\n{rows.shape[1]} {rows.shape[0]}\n255\n"
            )
            plain = " ".join(map(str, rows.ravel())).encode()
            image.write_bytes(
                head.encode() + (plain if self.form == "P2" else rows.tobytes())
            )
        file = folder / f"{name}.yaml"
        file.write_text(
            f"image: {image.name}\nmode: {self.mode}\nresolution: {self.resolution!r}\n"
            f"origin: [{', '.join(map(repr, self.origin))}]\n"
            f"negate: {int(self.negate)}\n"
            f"occupied_thresh: {self.occupied!r}\nfree_thresh: {self.free!r}\n"
        )
        return file

    def allowed(self, row: int, column: int) -> range:
        """The values that a cell may have; rows are counted from below."""
        grey = self.picture[len(self.picture) - 1 - row][column]
        if self.mode == "raw":
            return range(grey, grey + 1) if grey <= 100 else range(-1, 0)
        share = grey / 255 if self.negate else (255 - grey) / 255
        if share > self.occupied:
            return range(100, 101)
        if share < self.free:
            return range(1)
        if self.mode == "trinary":
            return range(-1, 0)
        # ROS 1 counts to 99 and cuts off, Nav2 counts to 100 and rounds.
        part = (share - self.free) / (self.occupied - self.free)
        return range(max(math.floor(1 + 98 * part) - 1, 1), math.ceil(100 * part) + 2)

    def place(self, row: float, column: float) -> tuple[float, float]:
        """Return a place of the world, given in cells from the lower left corner."""
        x, y, yaw = self.origin
        u, v = column * self.resolution, row * self.resolution
        return (
            x + u * math.cos(yaw) - v * math.sin(yaw),
            y + u * math.sin(yaw) + v * math.cos(yaw),
        )


GREYS = st.integers(0, 255)
WITHIN = st.floats(0.1, 0.9)
FAR = st.floats(-200, 200)


@st.composite
def plans(draw) -> Plan:
    width, height = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    row = st.tuples(*[GREYS] * width)
    # Thresholds between two greys, so that no rounding decides.
    levels = st.integers(0, 254).map(lambda grey: (grey + 0.5) / 255)
    low, high = sorted(draw(st.tuples(levels, levels).filter(lambda t: t[0] != t[1])))
    return Plan(
        draw(st.tuples(*[row] * height)),
        draw(st.sampled_from(["P5", "P2", "png", "bmp"])),
        draw(st.sampled_from([0.01, 0.05, 0.1, 0.25, 1.0])),
        (draw(FAR), draw(FAR), draw(st.floats(-7, 7))),
        draw(st.booleans()),
        high,
        low,
        draw(st.sampled_from(["trinary", "scale", "raw"])),
    )


def value_of(colour: tuple[int, int, int, int]) -> int:
    """Return the cell value of a colour of the raw palette."""
    red, green, blue, alpha = colour
    assert red == green == blue
    assert alpha == 255
    return -1 if red == 0 else 255 - red


async def shown(module):
    (only,) = await until(lambda: images(module.layer), lambda: module.layer.problems)
    return only


CORNER = Plan(((0, 255), (128, 255)), origin=(-3.0, 4.0, math.pi / 2), resolution=1.0)


@example(CORNER, 0.5, 0.5)
@example(replace(CORNER, negate=True, form="png"), 0.5, 0.5)
@example(replace(CORNER, mode="scale"), 0.1, 0.9)
@example(replace(CORNER, mode="raw", origin=(0.0, 0.0, -3.0)), 0.1, 0.9)
@given(plans(), WITHIN, WITHIN)
@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[
        HealthCheck.function_scoped_fixture,
        HealthCheck.too_slow,
    ],
)
def test_every_cell_of_a_map_file_is_placed_at_its_world_position(
    map, link, tmp_path_factory, plan, up, across
):
    file = plan.write(tmp_path_factory.mktemp("map"))

    async def scenario():
        return await shown(map.add_module("MapFile", file, palette="raw"))

    element = asyncio.run(scenario())
    rows, columns = plan.size
    assert image_of(element).size == (columns, rows)
    found = np.empty((rows, columns), np.int8)
    for row in range(rows):
        for column in range(columns):
            at = plan.place(row + up, column + across)
            found[row, column] = value_of(pixel(element, *at))
            assert found[row, column] in plan.allowed(row, column), (row, column)
    for row, column in [
        (-0.3, 0.5),
        (rows + 0.3, 0.5),
        (0.5, -0.3),
        (0.5, columns + 0.3),
    ]:
        assert pixel(element, *plan.place(row, column)) is None, "outside of the map"
    if plan.mode != "raw":
        # The same map from a topic, whose first row is the lowest.
        topic = map.add_module("OccupancyGrid", link, "/map", palette="raw")
        link.publish("/map", grid_message(plan, found))
        (other,) = images(topic.layer)
        for row in range(rows):
            for column in range(columns):
                at = plan.place(row + up, column + across)
                assert value_of(pixel(other, *at)) == found[row, column]
        map.remove_module(topic)


def grid_message(plan: Plan, cells: np.ndarray) -> dict:
    x, y, yaw = plan.origin
    turn = {"x": 0, "y": 0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    return {
        "header": header(),
        "info": {
            "map_load_time": header()["stamp"],
            "resolution": plan.resolution,
            "width": cells.shape[1],
            "height": cells.shape[0],
            "origin": {"position": {"x": x, "y": y, "z": 0}, "orientation": turn},
        },
        "data": cells.ravel().tolist(),
    }


def drawn(*rows: str) -> tuple[tuple[int, ...], ...]:
    """Return a picture made from characters for walls, unknown and free cells."""
    return tuple(tuple({"#": 0, "?": 205, ".": 254}[c] for c in row) for row in rows)


ROOM = drawn(
    "#########..",
    "#.......#..",
    "#.##....#..",
    "#.##.......",
    "#.......#??",
    "#########??",
)
SHADES = tuple(tuple(range(16 * row, 16 * row + 16)) for row in range(16))
MAPS = {
    "turned": Plan(ROOM, resolution=0.1, origin=(2.0, 3.0, 1.0)),
    "negative": Plan(
        tuple(tuple(255 - grey for grey in row) for row in ROOM),
        "png",
        0.1,
        (-2.0, -3.0, -1.0),
        negate=True,
    ),
    "upside-down": Plan(ROOM, "bmp", 0.05, (-12.2, -13.8, math.pi)),
    "scale": Plan(SHADES, "png", 0.25, (100.0, -50.0, 0.0), mode="scale"),
    "raw": Plan(SHADES, "P2", 1.0, (0.0, 0.0, -math.pi / 2), mode="raw"),
    "thresholds": Plan(SHADES, occupied=0.9, free=0.05, origin=(-1.0, 0.0, 0.3)),
}
"""The settings of map_server's test maps, and unusual settings."""


@pytest.fixture(scope="module")
def address(tmp_path_factory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("maps")
    bounds = {}
    for name, plan in MAPS.items():
        plan.write(folder, name)
        rows, columns = plan.size
        corners = [plan.place(r, c) for r in (0, rows) for c in (0, columns)]
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        bounds[name] = [*low.tolist(), *(high - low).tolist()]
    (folder / "bounds.json").write_text(json.dumps(bounds))
    with page_of(HERE / "page_of_maps.py", MAPS=str(folder)) as found:
        yield found


@pytest.fixture(scope="module")
def tab(chromium: Browser, address) -> Iterator[Page]:
    with watched_tab(chromium, 700, 600) as page:
        page.set_default_timeout(15_000)
        yield page


WORLD_TO_SCREEN = """() => {
  const m = document.querySelector("svg.webmap .world").getScreenCTM();
  return [m.a, m.b, m.c, m.d, m.e, m.f];
}"""


@pytest.mark.browser
@pytest.mark.parametrize("name", MAPS)
def test_a_browser_draws_every_cell_of_a_map_file_at_its_world_position(
    tab, address, name
):
    plan = MAPS[name]
    tab.goto(address.replace("/?", f"/{name}?"))
    image = tab.locator(".map-file > image[href]")
    image.wait_for(state="attached")
    rows, columns = plan.size
    tab.wait_for_function(DECODED)
    screen = Affine(*tab.evaluate(WORLD_TO_SCREEN))
    picture = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
    for row in range(rows):
        for column in range(columns):
            u, v = screen.apply(*plan.place(row + 0.5, column + 0.5))
            value = value_of((*picture.getpixel((round(u), round(v))), 255))
            assert value in plan.allowed(row, column), (row, column)


DECODED = """async () => {
  const bitmap = new Image();
  bitmap.src = document.querySelector(".map-file > image").getAttribute("href");
  await bitmap.decode();
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  return true;
}"""
