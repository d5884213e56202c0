"""Makers of SVG elements: ``svg.circle(r=0.2, fill="red")``.

There is one for each SVG tag that a scene allows. Children are positional arguments,
``text`` and attributes are keyword arguments.
"""

from webmap.scene.element import TagMaker

namespace = "http://www.w3.org/2000/svg"
"""The XML namespace of SVG."""

xlink_namespace = "http://www.w3.org/1999/xlink"
"""The XML namespace of XLink, for documents that still use it."""


class SvgMaker(TagMaker):
    """Makes SVG elements with one tag."""

    namespace = "svg"


circle = SvgMaker("circle")
clip_path = SvgMaker("clipPath")
defs = SvgMaker("defs")
desc = SvgMaker("desc")
ellipse = SvgMaker("ellipse")
g = SvgMaker("g")
image = SvgMaker("image")
line = SvgMaker("line")
linear_gradient = SvgMaker("linearGradient")
marker = SvgMaker("marker")
mask = SvgMaker("mask")
path = SvgMaker("path")
pattern = SvgMaker("pattern")
polygon = SvgMaker("polygon")
polyline = SvgMaker("polyline")
radial_gradient = SvgMaker("radialGradient")
rect = SvgMaker("rect")
stop = SvgMaker("stop")
svg = SvgMaker("svg")
symbol = SvgMaker("symbol")
text = SvgMaker("text")
text_path = SvgMaker("textPath")
title = SvgMaker("title")
tspan = SvgMaker("tspan")
use = SvgMaker("use")
