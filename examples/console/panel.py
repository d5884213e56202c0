"""The console of ``webmap view`` with a panel of one's own.

Start a rosbridge on the robot, or the simulator in its place, and then this::

    webmap sim --flat
    webmap run examples/console/panel.py
"""

import webmap
from webmap import html
from webmap.console import open_console

bridge = webmap.Bridge("ws://localhost:9090")
bob = webmap.RobotConfig.from_dict(
    {
        "name": "Bob",
        "bridge": bridge.url,
        "odometry": "/odom",
        "twist": {"topic": "/cmd_vel", "stops_within": 0.25},
        "battery": "/battery",
    }
)


class BatteryPanel:
    """A part of the column beside the map: the battery of the selected robot.

    It is a module of maps. Each viewer has a map of their own, and so a panel.
    """

    def __init__(self, map):
        self.map = map
        self.text = html.p()
        self.panel = html.section(html.h2(text="Battery"), self.text, class_="card")
        map.page.element("panel-body").append(self.panel)
        self.on_select()

    def on_select(self):
        """Show the robot that this viewer has selected."""
        robot = self.map.selected
        self.show(robot, None if robot is None else robot.charge)

    def on_battery_update(self, battery):
        """Show the new charge of the selected robot."""
        self.show(battery.robot, battery.charge)

    def show(self, robot, charge):
        """Show a charge, from 0 to 1, or that it is not known."""
        if robot is None:
            self.text.text = "Select a robot."
        elif charge is None:
            self.text.text = f"{robot.name}: unknown"
        else:
            self.text.text = f"{robot.name}: {charge:.0%}"

    def destroy(self):
        """Remove the panel."""
        self.panel.remove()


console = open_console([bridge], [bob])
console.add_module(BatteryPanel)

if __name__ == "__main__":
    webmap.run()
