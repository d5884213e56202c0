"""The layer tutorial: the voltage of a robot's battery, next to the robot.

Start the simulator and then this::

    webmap sim
    webmap run examples/module/voltage.py
"""

import webmap


@webmap.layer("sensor_msgs/BatteryState", kind="voltage", switch="Voltages", most=1)
class Voltage(webmap.RobotLayer):
    """The voltage of the battery, next to the robot."""

    frame = "robot"

    size: webmap.options.Metres = 0.3
    """Height of the letters, in metres."""

    def build(self):
        """Make the text, half a metre to the right of the robot."""
        text = webmap.svg.text(font_size=100 * self.size)
        self.text = self.upright(text, x=0.5)

    def draw(self, message, at):
        """Show a message."""
        self.text.text = f"{message.voltage:.1f} V"


bridge = webmap.Bridge("ws://localhost:9090")
robot = webmap.Robot("Robot 0", webmap.svg.circle(r=0.2, fill="teal"))
robot.set_odometry_topic(bridge, "/robot_0/odom")
robot.add_module("Voltage", bridge, "/robot_0/battery_state")


@webmap.page("/")
def main(page):
    """Build the page for one viewer."""
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("LayerSwitches")
    map.add_robot(robot)


webmap.run()
