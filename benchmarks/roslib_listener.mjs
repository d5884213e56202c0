// One roslib client that listens to the player, as benchmarks/listener.py does.
// Arguments: compression, port, topic, type, number of frames.
// Prints JSON: the processor time of this process for each frame, all threads.

import process from 'node:process';

import { Ros, Topic } from 'roslib2';

const [compression, port, name, messageType, count] = process.argv.slice(2);
const warm = 200;
const part = 200;
const ros = new Ros({ url: `ws://127.0.0.1:${port}` });
let seen = 0;
let began;
let wall;
let before;
let least = Infinity;

function used() {
  const { user, system } = process.cpuUsage();
  return user + system;
}

function onMessage(message) {
  void (message.pose ? message.pose.pose.position.x : message.ranges);
  seen += 1;
  if (seen < warm || (seen - warm) % part) return;
  const now = used();
  if (seen === warm) {
    began = now;
    wall = process.hrtime.bigint();
  } else least = Math.min(least, now - before);
  before = now;
  if (seen === Number(count)) {
    const frames = seen - warm;
    const figures = {
      'cpu a frame (us)': (now - began) / frames,
      'least cpu a frame (us)': least / part,
      'frames a second': frames / (Number(process.hrtime.bigint() - wall) / 1e9),
    };
    process.stdout.write(JSON.stringify(figures), () => process.exit(0));
  }
}

// Without a throttle and a queue, as the other clients.
const options = { ros, name, messageType, compression, throttle_rate: 0, queue_length: 0 };
new Topic(options).subscribe(onMessage);
