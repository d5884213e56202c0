import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

import { Session } from "../../../src/webmap/web/motion/session.js";

const HELLO = { op: "hello", connection: "c1" };
const REPORT = {
  op: "robot",
  robot: "r1",
  name: "Bob",
  state: "held",
  holder: { connection: "c1", name: "me" },
  mine: true,
  epoch: 7,
  armed: true,
  armable: true,
  sent: [0, 0, 0],
  measured: [0, 0, 0],
};

/** @type {Session} */
let session;
beforeEach(() => {
  session = new Session(0, {});
  session.loops.open(0);
});

/**
 * Drive r1 until a command moves it, with a gate that answers.
 *
 * @returns {any} The last command.
 */
function drive() {
  session.receive(HELLO, 0);
  session.receive({ op: "tick", tick: 100, ack: -1 }, 0);
  session.receive(REPORT, 0);
  session.pilot.choose("r1", 0);
  session.inputs.set("keys", { x: 1 }, 250);
  let last;
  for (let now = 250; now < 800; now += 50) {
    [last] = session.pilot.step(now, true);
    session.sent(last, now);
    session.receive({ op: "tick", tick: 100 + now, ack: Number(last.seq) }, now);
  }
  assert.equal(last?.x, 1, "the command drives");
  return last;
}

describe("a connection", () => {
  test("is open after the hello of the gate and not before", () => {
    assert.deepEqual(session.judge(100), []);
    assert.equal(session.state, "connecting");
    const { send, events } = session.receive(HELLO, 100);
    assert.deepEqual([send, events], [[], [["state", "open"]]]);
    assert.equal(session.connection, "c1");
    assert.deepEqual(session.judge(110), [], "an unchanged state emits no event");
  });

  test("of a page that may not drive is open between two of its few ticks", () => {
    session.receive({ ...HELLO, ticks: 2 }, 0);
    session.receive({ op: "tick", tick: 100, ack: -1 }, 0);
    assert.deepEqual(session.judge(700), []);
    assert.equal(session.state, "open");
    assert.equal(session.judge(951), null);
  });

  test("is late without ticks and is then given up", () => {
    session.receive(HELLO, 0);
    assert.deepEqual(session.judge(301), [["state", "late"]]);
    session.receive({ op: "tick", tick: 1, ack: -1 }, 310);
    assert.deepEqual(session.judge(320), [["state", "open"]]);
    assert.equal(session.judge(811), null);
  });

  test("that is lost ends leases and ticks and reports each robot", () => {
    drive();
    const [[kind, state], [also, report]] = session.lost(800);
    assert.deepEqual([kind, state], ["state", "lost"]);
    assert.deepEqual([also, report.robot, report.mine], ["robot", "r1", false]);
    assert.equal(session.connection, null);
    assert.equal(session.pilot.driven, null);
    assert.equal(session.loops.own.tick, null);
    assert.equal(session.inputs.blocked, true);
  });

  test("to a restarted gate begins without control and with blocked inputs", () => {
    drive();
    const { events } = session.receive({ op: "hello", connection: "c2" }, 800);
    assert.deepEqual(events, [], "the link was open all the time");
    assert.equal(session.connection, "c2");
    assert.equal(session.pilot.driven, null);
    assert.equal(session.inputs.blocked, true);
  });
});

describe("a STOP", () => {
  test("that could not be sent is the first command of the next connection, once", () => {
    session.stopped("*", false, 0);
    session.stopped("*", false, 10);
    assert.deepEqual(session.receive(HELLO, 100).send, [{ op: "stop", robot: "*" }]);
    session.receive({ ...REPORT, latched: true }, 150);
    session.lost(200);
    assert.deepEqual(session.receive(HELLO, 300).send, []);
  });

  test("that was sent on a lost connection is sent again until the gate answers", () => {
    session.receive(HELLO, 0);
    session.receive(REPORT, 0);
    session.stopped("r1", true, 10);
    session.receive({ ...REPORT, measured: [0.1, 0, 0] }, 20);
    session.lost(500);
    assert.deepEqual(session.receive(HELLO, 600).send, [{ op: "stop", robot: "r1" }]);
    session.lost(700);
    assert.deepEqual(session.receive(HELLO, 800).send, [{ op: "stop", robot: "r1" }]);
    session.receive({ ...REPORT, latched: true }, 850);
    session.lost(900);
    assert.deepEqual(session.receive(HELLO, 1000).send, []);
  });

  test("for all robots is sent again until every robot is stopped or gone", () => {
    session.receive(HELLO, 0);
    session.receive(REPORT, 0);
    session.receive({ ...REPORT, robot: "r2" }, 0);
    const third = { ...REPORT, robot: "r3", latched: true };
    session.receive({ ...third, stop: { id: "s1" } }, 0);
    session.stopped("*", true, 10);
    session.receive({ ...REPORT, latched: true }, 20);
    session.receive({ ...third, stop: { id: "s2" } }, 20);
    session.lost(500);
    assert.deepEqual(session.receive(HELLO, 600).send, [{ op: "stop", robot: "*" }]);
    session.receive({ ...REPORT, latched: true, stop: { id: "s3" } }, 650);
    session.receive({ ...third, stop: { id: "s3" } }, 650);
    session.receive({ op: "gone", robot: "r2" }, 650);
    session.lost(700);
    assert.deepEqual(session.receive(HELLO, 800).send, []);
  });

  test("pressed during an active STOP is answered only by a new STOP", () => {
    const active = (/** @type {string} */ id) => ({
      ...{ ...REPORT, state: "stopped", latched: true },
      stop: { by: "Ann", confirmed: true, why: "", id },
    });
    session.receive(HELLO, 0);
    session.receive(active("s1"), 0);
    session.stopped("r1", true, 10);
    session.receive(active("s1"), 20);
    session.receive(REPORT, 30); // another operator was quicker with a reset
    session.lost(500);
    assert.deepEqual(session.receive(HELLO, 600).send, [{ op: "stop", robot: "r1" }]);
    session.receive(active("s2"), 650);
    session.lost(700);
    assert.deepEqual(session.receive(HELLO, 800).send, []);
  });

  test("that a gate did not answer is sent again to the restarted gate", () => {
    drive();
    session.stopped("r1", true, 800);
    const { send } = session.receive({ op: "hello", connection: "c2" }, 810);
    assert.deepEqual(send, [{ op: "stop", robot: "r1" }]);
  });

  test("ends the lease, blocks the inputs and gets a verdict", () => {
    drive();
    session.stopped("r1", true, 800);
    assert.equal(session.pilot.driven, null);
    assert.equal(session.inputs.blocked, true);
    const [verdict] = session.verdicts(810);
    assert.deepEqual([verdict.robot, verdict.state], ["r1", "stopping"]);
  });

  test("for all robots before any is known is answered by a stopped or gone robot", () => {
    const again = (/** @type {object[]} */ ...messages) => {
      session = new Session(0, {});
      session.receive(HELLO, 0);
      session.stopped("*", true, 10);
      for (const message of messages) session.receive(message, 20);
      session.lost(30);
      return session.receive({ ...HELLO, connection: "c2" }, 40).send;
    };
    const stop = [{ op: "stop", robot: "*" }];
    const latched = { ...REPORT, state: "stopped", latched: true };
    assert.deepEqual(again(), stop);
    assert.deepEqual(again(REPORT), stop, "the report may be older than the STOP");
    assert.deepEqual(again(REPORT, { ...latched, robot: "r2" }), stop, "r1 still moves");
    assert.deepEqual(again({ op: "gone", robot: "r9" }), stop, "r9 is not known");
    assert.deepEqual(again(latched), []);
    assert.deepEqual(again(REPORT, latched), []);
    assert.deepEqual(again(REPORT, { op: "gone", robot: "r1" }), []);
    assert.deepEqual(again(latched, REPORT), [], "the STOP was reset meanwhile");
  });
});

describe("a message of the gate", () => {
  test("about a robot updates the robot and its request and emits an event", () => {
    const asker = { connection: "c9", name: "Ann", left: 8 };
    const { events } = session.receive({ ...REPORT, asker }, 0);
    assert.equal(events[0][0], "robot");
    assert.equal(session.pilot.robots.get("r1")?.name, "Bob");
    assert.equal(session.requests.requests(0)[0].who, "Ann");
  });

  test("about a robot that starts to move gives the time to motion", () => {
    drive();
    session.receive({ ...REPORT, measured: [0.5, 0, 0] }, 900);
    assert.ok(Number(session.motionDelay.delay("r1")) > 0);
  });

  test("about a gone robot removes the robot, its request and its verdict", () => {
    session.receive({ ...REPORT, asker: { connection: "c9", name: "", left: 8 } }, 0);
    session.stopped("r1", true, 0);
    assert.deepEqual(session.receive({ op: "gone", robot: "r1" }, 0).events, [
      ["gone", "r1"],
    ]);
    assert.equal(session.pilot.robots.size, 0);
    assert.deepEqual(session.requests.requests(0), []);
    assert.deepEqual(session.verdicts(0), []);
  });

  test("that refuses a velocity command emits an event and blocks the inputs", () => {
    drive();
    const no = { op: "refused", robot: "r1", what: "drive", why: "too old" };
    assert.deepEqual(session.receive(no, 800).events, [["refused", no]]);
    assert.equal(session.inputs.blocked, true);
  });

  test("with an unknown op is ignored", () => {
    assert.deepEqual(session.receive({ op: "sing" }, 0), { send: [], events: [] });
  });
});

describe("a page drives", () => {
  const goal = (state, id = "g1") => ({ id, state });
  const free = { ...REPORT, state: "free", holder: null, mine: false, epoch: null };

  test("while it has control of any robot", () => {
    session.receive(HELLO, 0);
    session.receive({ ...free, robot: "r2" }, 0);
    assert.equal(session.drives, false);
    session.receive({ ...REPORT, robot: "r2" }, 0);
    assert.equal(session.drives, true);
  });

  test("while a goal moves a robot that it sent a goal to, also on the next connection", () => {
    session.receive(HELLO, 0);
    session.receive({ ...free, goal: goal("under way", "g0") }, 0);
    assert.equal(session.drives, false, "the goal of another page");
    session.receive({ ...free, goal: goal("reached", "g0") }, 0);
    session.sent({ op: "goal", robot: "r1" }, 0);
    assert.equal(session.moves("r1"), true, "before the gate reports the goal");
    session.receive({ op: "refused", robot: "r1", what: "goal", why: "no" }, 0);
    assert.equal(session.moves("r1"), false, "a goal that was refused");
    session.sent({ op: "goal", robot: "r1" }, 0);
    session.lost(10);
    session.receive({ ...HELLO, connection: "c2" }, 20);
    session.receive({ ...free, goal: goal("under way") }, 20);
    assert.equal(session.drives, true);
    session.receive({ ...free, goal: goal("reached") }, 30);
    assert.equal(session.drives, false);
  });
});

describe("a page that knows its person", () => {
  const ANN = { person: "91c2", page: "p1" };
  const YOU = { op: "you", name: "Ann (desk 4)", ...ANN };
  const STOP = { by: "Ann (desk 4)", confirmed: true, why: "", id: "s1" };

  /** @param {object} changes */
  function report(changes) {
    session.receive(HELLO, 0);
    session.receive(YOU, 0);
    session.receive(structuredClone({ ...REPORT, mine: false, ...changes }), 0);
    return /** @type {any} */ (session.pilot.robots.get("r1"));
  }

  test("calls another page of this person so, and no other person", () => {
    const other = { connection: "c2", name: "Ann (desk 4)", identity: { ...ANN, page: "p2" } };
    assert.equal(report({ holder: other }).holder.name, "your other page");
    const eve = { ...other, identity: { person: "77aa", page: "p1" } };
    assert.equal(report({ holder: eve }).holder.name, "Ann (desk 4)");
    const asker = { ...other, left: 3 };
    assert.equal(report({ asker }).asker.name, "your other page");
    assert.equal(report({ holder: { connection: "c2", name: "Eve" } }).holder.name, "Eve");
  });

  test("names the STOP of this person, also after another name", () => {
    assert.equal(report({ stop: { ...STOP, by: "Eva", identity: ANN } }).stop.by, "you");
    const elsewhere = { ...STOP, identity: { ...ANN, page: "p2" } };
    assert.equal(report({ stop: elsewhere }).stop.by, "you, on another page");
    assert.equal(report({ stop: STOP }).stop.by, "Ann (desk 4)");
  });

  test("says you in the texts of the gate, which are the same for all pages", () => {
    const reason = "STOP by Ann (desk 4) is active: reset it first";
    assert.equal(report({ reason }).reason, "STOP by you is active: reset it first");
    const goal = { id: "g", why: "by Ann (desk 4)", state: "cancelled" };
    assert.equal(report({ goal }).goal.why, "by you");
    const refused = { op: "refused", robot: "r1", what: "take", why: "Ann (desk 4) has control" };
    const [[, told]] = session.receive({ ...refused }, 0).events;
    assert.equal(/** @type {any} */ (told).why, "your other page has control");
  });

  test("and gets no identity from an older gate changes nothing", () => {
    const known = { ...REPORT, stop: { ...STOP, identity: { person: "" } } };
    session.receive(HELLO, 0);
    session.receive(structuredClone(known), 0);
    const [robot] = session.pilot.robots.values();
    assert.equal(/** @type {any} */ (robot).stop.by, "Ann (desk 4)");
  });
});
