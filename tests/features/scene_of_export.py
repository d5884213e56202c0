"""A page with all kinds of styled elements, to be saved as a picture.

Run by ``webmap run``; nothing on it moves.
"""

from pathlib import Path

from module_fakes import Link, header, pose
from scene_of_layers import costs, marker, plan

import webmap
from webmap import svg

link = Link()
robot = webmap.Robot("Böb <&>")
robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
robot.add_module("Path", link, "/plan", age_limit=0.5)
robot.svg.append(
    svg.linear_gradient(
        svg.stop(offset=0, stop_color="red"),
        svg.stop(offset=1, class_="end"),
        id="fade",
    ),
    svg.rect(x=-1, y=0.5, width=1, height=0.3, fill="url(#fade)"),
    svg.text(text="Böb <&>", class_="turned"),
    svg.circle(r=0.05, class_="grown"),
    svg.circle(r=9, class_="gone"),
    svg.polyline(fill="none").set_line([(12345.678, -1.25), (5_000_000.5, 0.1)]),
)


@webmap.page("/", html=str(Path(__file__).with_name("page_of_export.html")))
def build(page) -> None:
    map = webmap.Map(page.element("webmap_container"))
    map.add_image("page_of_export.png", 1.5, 0.5, 1.5, 1.0)
    map.add_module("OccupancyGrid", link, "/map")
    map.add_module("OccupancyGrid", link, "/costs", palette="costmap")
    map.add_module("Markers", link, "/markers")
    map.add_module("ExportTool")
    map.add_module("ScaleBar")
    map.add_robot(robot)
    map.fit(-3.5, -2.5, 7, 5)
    map.rotate(20)
    link.publish("/odom", {"header": header(), "pose": pose(1.0, -1.0, 0.5)})
    link.publish("/map", plan(0))
    link.publish("/costs", costs(2))
    poses = [{"header": header(), "pose": pose(*at)} for at in [(1, -1), (2, 1)]]
    link.publish("/plan", {"header": header(), "poses": poses})
    cube = marker(1, 1, (-1.5, 0.25, 0.3), (0.5, 0.5, 0.5))
    words = marker(2, 9, (0, 0.4, 0), (0, 0, 0.3), "<b>Küche</b>")
    link.publish("/markers", {"markers": [cube, words]})
