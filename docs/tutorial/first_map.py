import webmap

bridge = webmap.Bridge("ws://localhost:9090")

bob = webmap.Robot("Bob", webmap.svg.circle(r=0.2, fill="red", stroke="black"))
bob.set_odometry_topic(bridge, "/robot_0/odom")
bob.set_twist_topic(bridge, "/robot_0/cmd_vel", stops_within=0.25)
bob.add_module("LaserScanner", bridge, "/robot_0/base_scan")


@webmap.page("/")
def main(page):
    map = webmap.Map(page.element("webmap_container"), 700, 500)
    map.add_module("MouseViewControl")
    map.add_module("Teleop", 1.0, 1.5)
    map.scale(500 / 58.7, map.canvas_width * 0.5, map.canvas_height * 0.5)
    map.add_robot(bob)


webmap.run()
