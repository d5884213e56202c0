"""Makers of SVG elements: ``svg.circle(r=0.2, fill="red")``.

There is one for each SVG tag that a scene allows. Children are positional arguments,
``text`` and attributes are keyword arguments.
"""

from webmap.scene.element import TagMaker

namespace = "http://www.w3.org/2000/svg"
"""The XML namespace of SVG."""

xlink_namespace = "http://www.w3.org/1999/xlink"
"""The XML namespace of XLink, for documents that still use it."""


class Maker(TagMaker):
    """Makes SVG elements with one tag."""

    namespace = "svg"


circle = Maker("circle")
clip_path = Maker("clipPath")
defs = Maker("defs")
desc = Maker("desc")
ellipse = Maker("ellipse")
g = Maker("g")
image = Maker("image")
line = Maker("line")
linear_gradient = Maker("linearGradient")
marker = Maker("marker")
mask = Maker("mask")
path = Maker("path")
pattern = Maker("pattern")
polygon = Maker("polygon")
polyline = Maker("polyline")
radial_gradient = Maker("radialGradient")
rect = Maker("rect")
stop = Maker("stop")
svg = Maker("svg")
symbol = Maker("symbol")
text = Maker("text")
text_path = Maker("textPath")
title = Maker("title")
tspan = Maker("tspan")
use = Maker("use")
