import assert from "node:assert/strict";
import { test } from "node:test";

import { Session } from "../../../src/webmap/web/motion/session.js";
import { describe } from "../../../src/webmap/web/motion/status.js";
import { CALM } from "../../../src/webmap/web/motion/commands.js";

const REPORT = {
  op: "robot",
  robot: "r1",
  name: "Bob",
  state: "free",
  doing: "free",
  holder: null,
  mine: false,
  epoch: null,
  armed: false,
  v: 1,
  w: 1,
  why: [],
  link: "up",
  sent: [0, 0, 0],
  echoed: null,
  measured: null,
  armable: true,
  reason: null,
};
const MINE = {
  ...REPORT,
  holder: { connection: "c1", name: "me" },
  mine: true,
  epoch: 3,
  armed: true,
  state: "held",
  doing: "held",
};
const FORWARD = { x: 1, y: 0, turn: 0 };

/** A page that loads: when it connects, and when its thread is blocked; in ms. */
const CONNECTED = 300;
const BUSY = [
  [400, 700],
  [900, 1200],
];
const END = 5000;

/**
 * Open a page, press a key at some time and hold it.
 *
 * @param {number} at When the key goes down, in ms after the page began.
 * @returns {{title: string, moved: boolean}} The title just before the press, and
 *     whether the robot moved.
 */
function pressAt(at) {
  const session = new Session(0, {});
  const { pilot } = session;
  let title = "Preparing input"; // the page shows this before anything else
  let [ack, tick, moved, pressed] = [-1, 0, false, false];
  const take = (/** @type {any[]} */ commands, /** @type {number} */ now) => {
    for (const { op, seq, x } of commands) {
      if (op === "take") session.receive(MINE, now);
      if (op === "drive") ack = seq;
      if (x) moved = true;
    }
  };
  for (let now = 0; now < END; now += 10) {
    if (BUSY.some(([from, to]) => now >= from && now < to)) continue;
    if (now === CONNECTED) {
      session.loops.open(now);
      session.receive({ op: "hello", connection: "c1" }, now);
      session.receive(REPORT, now);
      pilot.choose("r1", now);
    }
    if (now > CONNECTED) session.receive({ op: "tick", tick: ++tick, ack }, now);
    if (now >= at && !pressed) {
      pressed = true;
      session.inputs.set("keys", FORWARD, now);
      take(pilot.step(now, true), now);
    }
    if (now % 50 > 0) continue;
    take(pilot.step(now, true), now);
    if (pressed) continue;
    const status = { link: session.state, connection: "c1", ...pilot.status };
    title = describe(status, "r1", pilot.robots.get("r1") ?? null, true).title;
  }
  return { title, moved };
}

test("the first press moves the robot, or the page shows that input is being prepared", () => {
  const refused = [];
  for (let at = 0; at < 2500; at += 10) {
    const { title, moved } = pressAt(at);
    if (!moved && title !== "Preparing input") refused.push([at, title]);
  }
  assert.deepEqual(refused, []);
});

test("a page is ready for input soon after loading", () => {
  const last = BUSY[BUSY.length - 1][1];
  assert.deepEqual(pressAt(last + CALM + 60), { title: "Free", moved: true });
});
