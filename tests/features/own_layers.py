"""Layers of a user in one file, with public names only."""

import webmap
from webmap import svg


@webmap.layer(
    "sensor_msgs/Temperature",
    kind="temperature",
    names=r"temp",
    most=2,
    switch="Sensors",
)
class Temperature(webmap.RobotLayer):
    """The temperature beside the robot, in degrees Celsius."""

    frame = "robot"

    size: webmap.options.Metres = 0.3
    """The height of the letters, in metres."""

    age_limit: float = 5.0

    def build(self):
        self.text = self.upright(svg.text(font_size=100 * self.size), x=0.5)

    def draw(self, message, at):
        self.text.text = f"{message.temperature:.1f} °C"


class Spot(webmap.messages.Stamped, frozen=True, kw_only=True):
    """A message with a view of its own."""

    point: webmap.messages.PointMsg


@webmap.layer("my_msgs/Spot", kind="spot", view=Spot)
class OwnSpot(webmap.RobotLayer):
    """A spot in space, drawn from above."""

    def build(self):
        self.spot = self.add(svg.circle(r=0.1))

    def draw(self, message, at):
        place = at.apply(message.point.vector)
        self.spot.set_pose(place.x, place.y, 0.0)


@webmap.layer(
    "my_msgs/Zones",
    kinds=[webmap.TopicKind("zones", shared=True)],
    switch="Zones",
)
class Zones(webmap.MapLayer):
    """Circles on the map, of any number of robots."""

    colour: str = "orange"
    """The colour of the circles."""

    def draw(self, message, at):
        circles = [
            svg.circle(cx=zone.x, cy=zone.y, r=zone.radius, fill=self.colour)
            for zone in message.zones
        ]
        self.svg.clear().append(*circles)
