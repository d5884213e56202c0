import assert from "node:assert/strict";

import { Inputs } from "../../../src/webmap/web/motion/inputs.js";
import { RoundTrips } from "../../../src/webmap/web/motion/round_trips.js";
import { Pilot } from "../../../src/webmap/web/motion/pilot.js";

export const FORWARD = { x: 1, y: 0, turn: 0 };

/** A page that is stepped at 20 Hz, and a fake gate as the page sees it. */
export class Bench {
  constructor(options = {}) {
    this.now = 0;
    this.attentive = true;
    this.ticking = true;
    this.acking = true;
    this.arming = true;
    this.tick = 1000;
    this.ack = -1;
    this.epoch = 7;
    /** @type {any[]} */
    this.sent = [];
    this.loops = new RoundTrips();
    this.inputs = new Inputs(-1000);
    this.pilot = new Pilot(this.inputs, this.loops, 0, options);
    this.loops.open(0);
    this.loops.own.receive(this.tick, -1, 0);
    this.report("r1");
    this.report("r2");
    this.pilot.choose("r1", 0);
  }

  report(robot, fields = {}) {
    const report = {
      robot,
      name: robot,
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
      ...fields,
    };
    this.pilot.report(/** @type {any} */ (report), this.now);
  }

  grant(robot, epoch = ++this.epoch) {
    const holder = { connection: "c1", name: "me" };
    const held = { state: "held", doing: "held", armed: this.arming };
    this.report(robot, { holder, mine: true, epoch, ...held });
    return epoch;
  }

  keep(messages) {
    this.sent.push(...messages);
    for (const message of messages) {
      if (this.acking && message.seq !== undefined) this.ack = message.seq;
    }
    return messages;
  }

  press(axes = FORWARD) {
    this.inputs.set("keys", axes, this.now);
    return this.step(0);
  }

  letGo() {
    this.inputs.set("keys", null, this.now);
    return this.step(0);
  }

  step(dt = 50) {
    this.now += dt;
    if (this.ticking && dt > 0) this.loops.own.receive(++this.tick, this.ack, this.now);
    return this.keep(this.pilot.step(this.now, this.attentive));
  }

  run(ms) {
    const before = this.sent.length;
    for (let t = 0; t < ms; t += 50) this.step();
    return this.sent.slice(before);
  }

  /** Drive r1 forward until it moves. */
  drive() {
    this.press();
    const epoch = this.grant("r1");
    this.run(600);
    assert.equal(this.sent.at(-1).x, 1, "the bench drives");
    return epoch;
  }
}
