"""Files that are drawn below the robots of a fixed site: a floor, a picture, tiles."""

import math
from pathlib import Path

from fixed_messages import picture
from fixed_site import DATUM
from PIL import Image

FLOOR = """\
image: floor.png
resolution: 0.25
origin: [-4.0, -3.0, 0.2]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.2
"""
LEVEL = 20


def make_files(folder: Path) -> None:
    """Write ``floor.yaml`` and ``picture.png``, and ``tiles`` about the datum."""
    (folder / "picture.png").write_bytes(picture())
    floor = Image.new("L", (40, 30), 254)
    floor.paste(0, (0, 0, 40, 3))
    floor.paste(0, (5, 10, 12, 14))
    floor.save(folder / "floor.png")
    (folder / "floor.yaml").write_text(FLOOR)
    latitude, longitude = DATUM
    across = (longitude + 180) / 360 * 2**LEVEL
    up = math.asinh(math.tan(math.radians(latitude)))
    down = (1 - up / math.pi) / 2 * 2**LEVEL
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            file = folder / f"tiles/{LEVEL}/{int(across) + i}/{int(down) + j}.png"
            file.parent.mkdir(parents=True, exist_ok=True)
            Image.new("RGB", (256, 256), (120 + 40 * i, 120 + 40 * j, 90)).save(file)
