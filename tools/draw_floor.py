"""Draw the floor plan that comes with the simulator: ``python tools/draw_floor.py``.

It is an image for map_server, and also the picture under the robots. Dark walls and
furniture are occupied, white and pale colours are free, and the grey outside is
unknown.
Lengths are metres, x to the right and y up, from the middle of the building.
"""

import math
from collections.abc import Iterable
from pathlib import Path

from PIL import Image, ImageDraw

DATA = Path(__file__).parents[1] / "src" / "webmap" / "sim" / "data"
RESOLUTION = 0.05
LEFT, BOTTOM, WIDTH, HEIGHT = -21.0, -13.5, 42.0, 27.0

# map_server uses the mean of the three components: below 89 is occupied, above
# 205 is free, and 205 is unknown.
OUTSIDE = (203, 205, 207)
WALL = (38, 43, 52)
FURNITURE = (70, 84, 104)
SOFT = (78, 88, 92)
FLOOR = (254, 254, 254)
CORRIDOR = (246, 247, 249)
HALL = (249, 247, 243)
TILES = (240, 246, 247)
HINT = (221, 226, 232)

YAML = f"""\
image: floor.png
mode: trinary
resolution: {RESOLUTION}
origin: [{LEFT}, {BOTTOM}, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""

Colour = tuple[int, int, int]


class Sheet:
    """A drawing in metres."""

    def __init__(self) -> None:
        size = (round(WIDTH / RESOLUTION), round(HEIGHT / RESOLUTION))
        self.image = Image.new("RGB", size, OUTSIDE)
        self._draw = ImageDraw.Draw(self.image)

    def box(self, x0: float, y0: float, x1: float, y1: float, fill: Colour) -> None:
        """Fill the rectangle between two corners."""
        left, top = self._pixel(min(x0, x1), max(y0, y1))
        right, bottom = self._pixel(max(x0, x1), min(y0, y1))
        self._draw.rectangle((left, top, right - 1, bottom - 1), fill)

    def disc(self, x: float, y: float, radius: float, fill: Colour) -> None:
        """Fill a circle."""
        left, top = self._pixel(x - radius, y + radius)
        right, bottom = self._pixel(x + radius, y - radius)
        self._draw.ellipse((left, top, right - 1, bottom - 1), fill)

    def swing(self, x: float, y: float, radius: float, start: float) -> None:
        """Draw a door that is open at ``start`` degrees, and its swing."""
        left, top = self._pixel(x - radius, y + radius)
        right, bottom = self._pixel(x + radius, y - radius)
        box = (left, top, right - 1, bottom - 1)
        self._draw.arc(box, -start, 90 - start, HINT)
        end_x = x + radius * math.cos(math.radians(start))
        end_y = y + radius * math.sin(math.radians(start))
        self._draw.line((*self._pixel(x, y), *self._pixel(end_x, end_y)), HINT)

    def line(self, x0: float, y0: float, x1: float, y1: float, fill: Colour) -> None:
        """Draw a thin line."""
        self._draw.line((*self._pixel(x0, y0), *self._pixel(x1, y1)), fill)

    def _pixel(self, x: float, y: float) -> tuple[int, int]:
        return (
            round((x - LEFT) / RESOLUTION),
            round((BOTTOM + HEIGHT - y) / RESOLUTION),
        )


THIN, THICK, DOOR = 0.2, 0.25, 1.2


def wall_across(
    sheet: Sheet, y: float, x0: float, x1: float, doors: Iterable[float] = ()
) -> None:
    """Draw a wall along x, with doors centered at the given positions."""
    sheet.box(x0, y - THIN / 2, x1, y + THIN / 2, WALL)
    for x in doors:
        sheet.box(x - DOOR / 2, y - THIN / 2, x + DOOR / 2, y + THIN / 2, FLOOR)


def wall_up(
    sheet: Sheet, x: float, y0: float, y1: float, doors: Iterable[float] = ()
) -> None:
    """Draw a wall along y, with doors centered at the given positions."""
    sheet.box(x - THIN / 2, y0, x + THIN / 2, y1, WALL)
    for y in doors:
        sheet.box(x - THIN / 2, y - DOOR / 2, x + THIN / 2, y + DOOR / 2, FLOOR)


def desk(sheet: Sheet, x: float, y: float, chair: float) -> None:
    """Draw a desk of 1.6 by 0.8 m and its chair, ``chair`` metres above its center."""
    sheet.box(x - 0.8, y - 0.4, x + 0.8, y + 0.4, FURNITURE)
    sheet.disc(x, y + chair, 0.25, SOFT)


def table(sheet: Sheet, x: float, y: float, radius: float) -> None:
    """Draw a round table with four stools."""
    sheet.disc(x, y, radius, FURNITURE)
    for quarter in range(4):
        angle = math.pi / 4 + quarter * math.pi / 2
        reach = radius + 0.3
        sheet.disc(x + reach * math.cos(angle), y + reach * math.sin(angle), 0.2, SOFT)


def floors(sheet: Sheet) -> None:
    """Fill the building with its floors, and draw the outer wall around it."""
    sheet.box(-20, -12.5, 20, 12.5, WALL)
    sheet.box(-20 + THICK, -12.5 + THICK, 20 - THICK, 12.5 - THICK, FLOOR)
    sheet.box(-19.75, -1.25, 7, 1.25, CORRIDOR)
    sheet.box(-7.25, 1.25, -4.75, 12.25, CORRIDOR)
    sheet.box(7, -5.5, 19.75, 12.25, HALL)
    sheet.box(7, -12.25, 19.75, -5.5, TILES)


def walls(sheet: Sheet) -> None:
    """Draw the inner walls."""
    # The corridor from west to east, with the rooms' doors.
    wall_across(sheet, 1.25, -20, -7.25, doors=(-17.2, -11.5))
    wall_across(sheet, 1.25, -4.75, 7, doors=(-2.4, 4.4))
    wall_across(sheet, -1.25, -20, 7, doors=(-15.8, -9.2, -2.6, 3.9))
    # Two offices and the meeting room in the north-west, by the corridor to the north.
    wall_up(sheet, -7.25, 1.25, 12.5, doors=(9.6,))
    wall_up(sheet, -4.75, 1.25, 12.5, doors=(9.2,))
    wall_up(sheet, -14.0, 1.25, 6.9)
    wall_across(sheet, 6.9, -20, -7.25, doors=(-16.8,))
    # The open office and two small ones in the north.
    wall_across(sheet, 6.4, -4.75, 7, doors=(-3.2,))
    wall_up(sheet, 1.2, 1.25, 6.4)
    # The hall behind its wide opening.
    wall_up(sheet, 7.0, -12.5, 12.5)
    sheet.box(6.9, -1.2, 7.1, 1.2, HALL)
    sheet.box(6.9, 8.0, 7.1, 10.4, HALL)
    # The south: workshop, store, laboratory, and the canteen by the hall.
    wall_up(sheet, -12.5, -12.5, -1.25, doors=(-9.6,))
    wall_up(sheet, -6.0, -12.5, -1.25)
    wall_up(sheet, 0.6, -12.5, -1.25, doors=(-4.2,))
    wall_across(sheet, -5.5, 7.0, 20, doors=(17.6,))
    sheet.box(9.4, -5.7, 12.4, -5.3, TILES)


def doors(sheet: Sheet) -> None:
    """Draw the doors' swings into the rooms; they count as free."""
    for x in (-17.2, -11.5, -2.4, 4.4):
        sheet.swing(x - DOOR / 2, 1.32, DOOR, 90)
    for x in (-15.8, -9.2, -2.6, 3.9):
        sheet.swing(x + DOOR / 2, -1.33, DOOR, 270)
    sheet.swing(-16.8 - DOOR / 2, 6.98, DOOR, 90)
    sheet.swing(-3.2 - DOOR / 2, 6.48, DOOR, 90)


def offices(sheet: Sheet) -> None:
    """Furnish the north-west and the north."""
    for x in (-18.6, -16.2):
        desk(sheet, x, 5.9, -0.75)
    sheet.box(-19.75, 1.8, -19.25, 3.6, FURNITURE)
    for x in (-12.4, -9.6):
        desk(sheet, x, 5.9, -0.75)
    sheet.box(-7.85, 1.8, -7.35, 4.2, FURNITURE)
    # The meeting room: a long table with chairs.
    sheet.box(-16.4, 9.1, -11.2, 10.3, FURNITURE)
    for i in range(5):
        x = -15.8 + i * 1.0
        sheet.disc(x, 8.75, 0.22, SOFT)
        sheet.disc(x, 10.65, 0.22, SOFT)
    sheet.box(-19.75, 8.4, -19.45, 11.0, FURNITURE)
    # Two small offices.
    desk(sheet, -0.4, 5.3, -0.75)
    sheet.box(-4.65, 3.4, -4.2, 5.6, FURNITURE)
    desk(sheet, 3.0, 5.3, -0.75)
    sheet.box(6.4, 2.4, 6.9, 5.2, FURNITURE)
    # The open office: islands of four desks.
    for x in (-1.0, 3.2):
        for dx in (-0.82, 0.82):
            desk(sheet, x + dx, 9.55, 0.75)
            desk(sheet, x + dx, 8.65, -0.75)
    sheet.box(-4.6, 11.8, 0.4, 12.2, FURNITURE)


def south(sheet: Sheet) -> None:
    """Furnish the workshop, the store and the laboratory."""
    sheet.box(-19.75, -12.25, -13.2, -11.5, FURNITURE)
    sheet.box(-19.75, -11.5, -19.0, -5.0, FURNITURE)
    sheet.box(-17.0, -8.6, -14.6, -6.4, FURNITURE)
    sheet.disc(-16.9, -4.2, 0.45, SOFT)
    for x in (-11.2, -9.25, -7.3):
        sheet.box(x - 0.35, -11.9, x + 0.35, -4.4, FURNITURE)
    for y in (-10.6, -7.4):
        sheet.box(-4.6, y - 0.5, -1.0, y + 0.5, FURNITURE)
        for x in (-4.0, -2.8, -1.6):
            sheet.disc(x, y - 0.8, 0.2, SOFT)
    sheet.box(-5.9, -5.0, -5.4, -2.2, FURNITURE)
    sheet.box(1.4, -12.25, 6.4, -11.6, FURNITURE)
    sheet.box(2.2, -9.2, 5.4, -7.2, FURNITURE)
    sheet.disc(5.9, -5.0, 0.5, SOFT)
    sheet.box(1.0, -2.0, 2.6, -1.4, FURNITURE)


def hall(sheet: Sheet) -> None:
    """Furnish the open hall and the canteen."""
    for x in (10.2, 14.0, 17.8):
        for y in (-2.2, 3.2, 8.6):
            sheet.box(x - 0.25, y - 0.25, x + 0.25, y + 0.25, WALL)
    # The reception: a counter with a corner, and the chair behind it.
    sheet.box(12.2, 5.4, 15.8, 6.0, FURNITURE)
    sheet.box(12.2, 6.0, 12.8, 7.2, FURNITURE)
    sheet.disc(14.2, 6.6, 0.25, SOFT)
    # Seats by the window, plants in the corners, the entrance in the east.
    for y in (-3.8, -0.6, 9.4):
        sheet.box(18.9, y, 19.6, y + 1.9, SOFT)
    for x, y in ((7.7, 11.6), (19.2, 11.7), (7.7, -4.8), (19.2, -4.9)):
        sheet.disc(x, y, 0.4, SOFT)
    sheet.box(19.75, 2.0, 20.0, 4.4, FURNITURE)
    for offset in (0.0, 1.0, 2.0):
        sheet.line(18.2 + offset / 2, 2.2, 18.2 + offset / 2, 4.2, HINT)
    # The canteen.
    sheet.box(7.2, -12.25, 13.4, -11.6, FURNITURE)
    sheet.box(18.9, -12.25, 19.75, -9.6, FURNITURE)
    for x, y in ((10.0, -9.4), (13.4, -8.2), (16.6, -10.4), (16.0, -7.4), (9.2, -7.0)):
        table(sheet, x, y, 0.5)


def draw() -> Image.Image:
    """Return the floor plan."""
    sheet = Sheet()
    for part in (floors, walls, doors, offices, south, hall):
        part(sheet)
    return sheet.image


def main() -> None:
    """Write the image and its YAML."""
    DATA.mkdir(exist_ok=True)
    draw().quantize(32, dither=Image.Dither.NONE).save(
        DATA / "floor.png", optimize=True
    )
    (DATA / "floor.yaml").write_text(YAML, encoding="utf-8")


if __name__ == "__main__":
    main()
