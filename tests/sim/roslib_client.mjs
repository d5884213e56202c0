// What a browser application does with roslib, told as one JSON object on stdout.
// Arguments: the bridge's URL, its dialect, the package that is roslib.

const [url, dialect, name] = process.argv.slice(2);
const loaded = await import(name);
const ROSLIB = loaded.Ros ? loaded : loaded.default;
const ros2 = dialect === 'ros2';
const type = (pkg, kind, message) => (ros2 ? `${pkg}/${kind}/${message}` : `${pkg}/${message}`);
const told = {};

const ros = new ROSLIB.Ros({ url });
await new Promise((resolve, reject) => {
  ros.on('connection', resolve);
  ros.on('error', reject);
});

const ask = (method, ...args) =>
  new Promise((resolve, reject) => ros[method](...args, resolve, reject));
const topic = (path, messageType, more = {}) =>
  new ROSLIB.Topic({ ros, name: path, messageType, ...more });
const first = (path, messageType, more) =>
  new Promise((resolve) => {
    const subscribed = topic(path, messageType, more);
    subscribed.subscribe((message) => {
      subscribed.unsubscribe();
      resolve(message);
    });
  });
const call = (service, serviceType, request) =>
  new Promise((resolve, reject) =>
    new ROSLIB.Service({ ros, name: service, serviceType }).callService(request, resolve, reject),
  );

const topics = await ask('getTopics');
told.topics = Object.fromEntries(topics.topics.map((path, i) => [path, topics.types[i]]));
told.services = await ask('getServices');
told.nodes = await ask('getNodes');
told.odomType = await ask('getTopicType', '/robot_0/odom');
told.odomTopics = await ask('getTopicsForType', type('nav_msgs', 'msg', 'Odometry'));
told.stopType = await ask('getServiceType', '/robot_0/stop');
told.actionServers = await ask('getActionServers');
if (!ros2) {
  // The real ROS 2 rosapi dies of this one.
  const details = await ask('getMessageDetails', 'geometry_msgs/Twist');
  told.twist = ros.decodeTypeDefs(details);
}

const odom = type('nav_msgs', 'msg', 'Odometry');
const scan = type('sensor_msgs', 'msg', 'LaserScan');
const before = await first('/robot_0/odom', odom);
told.before = before.pose.pose.position;
told.ranges = {};
for (const compression of ros2 ? ['none', 'cbor'] : ['none', 'cbor', 'png']) {
  // The 1.x line decodes png with a package that only browsers have.
  if (compression === 'png' && !loaded.Ros) continue;
  const { ranges } = await first('/robot_0/base_scan', scan, { compression });
  told.ranges[compression] = ranges.length;
}
const grid = await first('/map', type('nav_msgs', 'msg', 'OccupancyGrid'), { compression: 'cbor' });
told.cells = grid.data.length;
told.size = [grid.info.width, grid.info.height];

const twist = topic('/robot_0/cmd_vel', type('geometry_msgs', 'msg', 'Twist'));
const go = { linear: { x: 0.5, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } };
const driving = setInterval(() => twist.publish(go), 50);
told.after = await new Promise((resolve) => {
  const moving = topic('/robot_0/odom', odom);
  moving.subscribe((message) => {
    const { x, y } = message.pose.pose.position;
    if (Math.hypot(x - told.before.x, y - told.before.y) > 0.3) {
      moving.unsubscribe();
      resolve({ x, y });
    }
  });
});
clearInterval(driving);

told.stop = await call('/robot_0/stop', type('std_srvs', 'srv', 'Trigger'), {});
told.missing = await call('/no/such/service', 'std_srvs/Trigger', {}).catch(String);

// On a socket of its own: a real ROS 2 server lets a call block all that follows on its
// socket, the answer to it included.
const server = new ROSLIB.Ros({ url });
await new Promise((resolve) => server.on('connection', resolve));
const served = new ROSLIB.Service({
  ros: server,
  name: '/from_roslib',
  serviceType: type('std_srvs', 'srv', 'SetBool'),
});
await served.advertise((request, response) => {
  response.success = request.data;
  response.message = 'from roslib';
  return true;
});
while (!(await ask('getServices')).includes('/from_roslib'));
told.served = await call('/from_roslib', type('std_srvs', 'srv', 'SetBool'), { data: true });

const { x, y } = told.after;
const pose = { position: { x, y, z: 0 }, orientation: { x: 0, y: 0, z: 0.7, w: 0.7 } };
const target = { header: { frame_id: 'map' }, pose };
if (!ros2) {
  const client = new ROSLIB.ActionClient({
    ros,
    serverName: '/robot_0/move_base',
    actionName: 'move_base_msgs/MoveBaseAction',
  });
  const goal = new ROSLIB.Goal({ actionClient: client, goalMessage: { target_pose: target } });
  goal.send();
  await new Promise((resolve) => goal.on('result', resolve));
  told.goal = goal.status.status;
} else if (ROSLIB.Action) {
  const action = new ROSLIB.Action({
    ros,
    name: '/robot_0/navigate_to_pose',
    actionType: 'nav2_msgs/action/NavigateToPose',
  });
  told.goal = await new Promise((resolve, reject) =>
    action.sendGoal({ pose: target }, resolve, () => {}, reject),
  );
}

ros.close();
console.log(JSON.stringify(told));
process.exit(0);
