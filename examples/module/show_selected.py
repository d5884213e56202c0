"""The module tutorial: a map module that names the selected robot.

Start the simulator and then this::

    webmap sim
    webmap run examples/module/show_selected.py
"""

import webmap


@webmap.modules.map.register
class ShowName:
    """Shows the name of the selected robot in an element of the page."""

    def __init__(self, map, element, default_msg="No selection"):
        # Remember the arguments so that the methods can use them.
        self.map = map
        self.element = element
        self.default_msg = default_msg

        # Show the selection when the module is made. Otherwise the element would stay
        # empty until the selection changes.
        self.on_select()

    def destroy(self):
        """Clean up when the module is removed."""
        self.element.text = ""

    def on_select(self):
        """React to a change of the selection."""
        if self.map.selected:
            self.element.text = self.map.selected.name
        else:
            self.element.text = self.default_msg


bridge = webmap.Bridge("ws://localhost:9090")
robot = webmap.Robot("Robot 0")
robot.set_odometry_topic(bridge, "/robot_0/odom")


@webmap.page("/", html="index.html")
def main(page):
    """Build the page for one viewer."""
    map = webmap.Map(page.element("webmap_container"), 700, 500)
    map.add_module("ShowName", page.element("show_selected"))
    map.scale(40)
    map.add_robot(robot)
    map.follow(robot)


webmap.run()
