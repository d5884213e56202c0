"""Makers of HTML elements: ``html.button("Stop", class_="stop")``.

There is one for each HTML tag that a scene allows. Children are positional arguments,
``text`` and attributes are keyword arguments.
"""

from webmap.scene.element import TagMaker


class HtmlMaker(TagMaker):
    """Makes HTML elements with one tag."""

    namespace = "html"


a = HtmlMaker("a")
article = HtmlMaker("article")
aside = HtmlMaker("aside")
br = HtmlMaker("br")
button = HtmlMaker("button")
canvas = HtmlMaker("canvas")
caption = HtmlMaker("caption")
code = HtmlMaker("code")
dd = HtmlMaker("dd")
details = HtmlMaker("details")
dialog = HtmlMaker("dialog")
div = HtmlMaker("div")
dl = HtmlMaker("dl")
dt = HtmlMaker("dt")
em = HtmlMaker("em")
fieldset = HtmlMaker("fieldset")
figcaption = HtmlMaker("figcaption")
figure = HtmlMaker("figure")
footer = HtmlMaker("footer")
h1 = HtmlMaker("h1")
h2 = HtmlMaker("h2")
h3 = HtmlMaker("h3")
h4 = HtmlMaker("h4")
header = HtmlMaker("header")
hr = HtmlMaker("hr")
img = HtmlMaker("img")
input = HtmlMaker("input")
kbd = HtmlMaker("kbd")
label = HtmlMaker("label")
legend = HtmlMaker("legend")
li = HtmlMaker("li")
main = HtmlMaker("main")
meter = HtmlMaker("meter")
nav = HtmlMaker("nav")
ol = HtmlMaker("ol")
optgroup = HtmlMaker("optgroup")
option = HtmlMaker("option")
output = HtmlMaker("output")
p = HtmlMaker("p")
pre = HtmlMaker("pre")
progress = HtmlMaker("progress")
section = HtmlMaker("section")
select = HtmlMaker("select")
small = HtmlMaker("small")
span = HtmlMaker("span")
strong = HtmlMaker("strong")
summary = HtmlMaker("summary")
table = HtmlMaker("table")
tbody = HtmlMaker("tbody")
td = HtmlMaker("td")
textarea = HtmlMaker("textarea")
tfoot = HtmlMaker("tfoot")
th = HtmlMaker("th")
thead = HtmlMaker("thead")
time = HtmlMaker("time")
tr = HtmlMaker("tr")
ul = HtmlMaker("ul")
