"""A page with tiles that carry their numbers as colours, and fixes on them.

Run by ``webmap run``; ``made_tiles`` is used by the test too.
"""

import math
import os
from pathlib import Path

from PIL import Image, ImageDraw

DATUM = (50.0755, 14.4378)
EAST = 25.0
FIXES = [(50.0755, 14.4378), (50.0762, 14.4391)]
LEVELS = range(15, 19)


def number(z: int, lat: float, lon: float) -> tuple[float, float]:
    """Return a place in tiles of a level."""
    y = 1 - math.asinh(math.tan(math.radians(lat))) / math.pi
    return (lon + 180) / 360 * 2**z, y / 2 * 2**z


def colour(z: int, x: int, y: int) -> tuple[int, int, int]:
    return 60 + x % 4 * 48, 60 + y % 4 * 48, 100 + (z - 15) * 40


def made_tiles(folder: Path) -> None:
    """Draw tiles about the datum, with a black disc at each fix; one is missing."""
    for z in LEVELS:
        at = number(z, *DATUM)
        for x in range(int(at[0]) - 4, int(at[0]) + 6):
            for y in range(int(at[1]) - 4, int(at[1]) + 5):
                if (z, x, y) == missing():
                    continue
                image = Image.new("RGB", (256, 256), colour(z, x, y))
                draw = ImageDraw.Draw(image)
                for fix in FIXES:
                    u, v = number(z, *fix)
                    u, v = (u - x) * 256, (v - y) * 256
                    draw.ellipse((u - 5, v - 5, u + 5, v + 5), fill=(0, 0, 0))
                file = folder / str(z) / str(x) / f"{y}.png"
                file.parent.mkdir(parents=True, exist_ok=True)
                image.save(file)


def missing() -> tuple[int, int, int]:
    x, y = number(17, *DATUM)
    return 17, int(x) + 1, int(y) + 1


if __name__ == "__main__":
    from module_fakes import Link, header

    import webmap

    link = Link()
    robots = [webmap.Robot(name) for name in ("A", "B")]
    fixes = [
        robot.add_module("NavSatFix", link, f"/fix{i}", datum=DATUM, east=EAST)
        for i, robot in enumerate(robots)
    ]
    for i, robot in enumerate(robots):
        robot.set_odometry_topic(link, f"/odom{i}", type="geometry_msgs/Pose2D")

    @webmap.page("/")
    def build(page):
        map = webmap.Map(page.element("webmap_container"))
        map.add_module("MouseViewControl")
        map.add_module(
            "TileLayer",
            os.environ["TILES"],
            DATUM,
            east=EAST,
            attribution="<b>Nobody's</b> tiles",
            most=30,
        )
        for i, robot in enumerate(robots):
            map.add_robot(robot)
            lat, lon = FIXES[i]
            link.publish(f"/odom{i}", {"x": 300.0 + i, "y": -200.0, "theta": 1.0})
            status = {"status": 0, "service": 1}
            fix = {"latitude": lat, "longitude": lon, "status": status}
            link.publish(f"/fix{i}", {"header": header("gps"), **fix})
        map.fit(-350, -270, 700, 540)
