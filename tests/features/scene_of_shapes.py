"""A page with a marker of every type, with a link whose messages this script makes.

Run by ``webmap run``; the messages are decoded as those of a robot are.
"""

from module_fakes import Link
from shapes_of_markers import SHAPES

import webmap

link = Link()


@webmap.page("/")
def build(page) -> None:
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("Markers", link, "/shapes")
    map.fit(-3.5, -2.5, 7, 5)
    messages = [shape.message(n) for n, shape in enumerate(SHAPES.values())]
    link.publish("/shapes", {"markers": messages})
