// A page that draws the robots of a rosbridge with ros2d, as its examples do.

/* global ROSLIB, ROS2D */

globalThis.show = (url, robots) => {
  const map = document.createElement("div");
  map.id = "map";
  document.body.append(map);
  const viewer = new ROS2D.Viewer({ divID: "map", width: 1000, height: 700 });
  viewer.scaleToDimensions(110, 77);
  const ros = new ROSLIB.Ros({ url });
  for (let number = 0; number < robots; number++) {
    const robot = new ROS2D.NavigationArrow({ size: 1, strokeSize: 0.1, pulse: false });
    viewer.scene.addChild(robot);
    const topic = new ROSLIB.Topic({
      ros,
      name: `/robot_${number}/odom`,
      messageType: "nav_msgs/Odometry",
      throttle_rate: 100,
    });
    topic.subscribe(({ pose: { pose } }) => {
      robot.x = pose.position.x;
      robot.y = -pose.position.y - (number % 70);
      robot.rotation = viewer.scene.rosQuaternionToGlobalTheta(pose.orientation);
      robot.visible = true;
      globalThis.seen = (globalThis.seen ?? 0) + 1;
    });
  }
};
