"""Makers of HTML elements: ``html.button("Stop", class_="stop")``.

There is one for each HTML tag that a scene allows. Children are positional arguments,
``text`` and attributes are keyword arguments.
"""

from webmap.scene.element import TagMaker


class Maker(TagMaker):
    """Makes HTML elements with one tag."""

    namespace = "html"


a = Maker("a")
article = Maker("article")
aside = Maker("aside")
br = Maker("br")
button = Maker("button")
canvas = Maker("canvas")
caption = Maker("caption")
code = Maker("code")
dd = Maker("dd")
details = Maker("details")
dialog = Maker("dialog")
div = Maker("div")
dl = Maker("dl")
dt = Maker("dt")
em = Maker("em")
fieldset = Maker("fieldset")
figcaption = Maker("figcaption")
figure = Maker("figure")
footer = Maker("footer")
h1 = Maker("h1")
h2 = Maker("h2")
h3 = Maker("h3")
h4 = Maker("h4")
header = Maker("header")
hr = Maker("hr")
img = Maker("img")
input = Maker("input")
kbd = Maker("kbd")
label = Maker("label")
legend = Maker("legend")
li = Maker("li")
main = Maker("main")
meter = Maker("meter")
nav = Maker("nav")
ol = Maker("ol")
optgroup = Maker("optgroup")
option = Maker("option")
output = Maker("output")
p = Maker("p")
pre = Maker("pre")
progress = Maker("progress")
section = Maker("section")
select = Maker("select")
small = Maker("small")
span = Maker("span")
strong = Maker("strong")
summary = Maker("summary")
table = Maker("table")
tbody = Maker("tbody")
td = Maker("td")
textarea = Maker("textarea")
tfoot = Maker("tfoot")
th = Maker("th")
thead = Maker("thead")
time = Maker("time")
tr = Maker("tr")
ul = Maker("ul")
