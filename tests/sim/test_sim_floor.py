import runpy
from pathlib import Path

import numpy as np
from PIL import Image

from webmap.sim.maps import FLOOR

TOOL = Path(__file__).parents[2] / "tools" / "draw_floor.py"


def test_the_shipped_floor_matches_the_output_of_the_drawing_tool():
    tool = runpy.run_path(str(TOOL))
    assert FLOOR.read_text() == tool["YAML"]
    with Image.open(FLOOR.with_name("floor.png")) as shipped:
        drawn = np.asarray(tool["draw"]())
        assert (np.asarray(shipped.convert("RGB")) == drawn).all()
