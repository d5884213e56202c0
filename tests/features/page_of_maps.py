"""A page that shows each map file of a folder, at ``/NAME``; run by ``webmap run``.

``MAPS`` is the folder; ``bounds.json`` in it has the part of the world to show.
"""

import json
import os
from pathlib import Path

import webmap


def show(page: webmap.Page, file: Path) -> None:
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("MapFile", file, palette="raw")
    map.fit(*bounds[file.stem])


folder = Path(os.environ["MAPS"])
bounds = json.loads((folder / "bounds.json").read_text())
for file in folder.glob("*.yaml"):

    @webmap.page(f"/{file.stem}")
    def page(page, file=file) -> None:
        show(page, file)
