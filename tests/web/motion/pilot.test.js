import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

import { TAKE_PATIENCE } from "../../../src/webmap/web/motion/leases.js";
import { Bench, FORWARD } from "./pilot_bench.js";

const moves = (messages) =>
  messages.filter((m) => m.op === "drive" && (m.x !== 0 || m.y !== 0 || m.turn !== 0));

/** @type {Bench} */
let bench;
beforeEach(() => {
  bench = new Bench();
});

describe("the first press", () => {
  test("takes control of a free robot and sends nothing else", () => {
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r1" }]);
    assert.deepEqual(bench.run(200), []);
  });

  test("moves the robot after the gate has received neutral for 200 ms", () => {
    bench.press();
    const epoch = bench.grant("r1");
    const messages = bench.run(600);
    const first = messages.findIndex((m) => m.x === 1);
    assert.ok(first >= 5, `${first} neutral commands came first`);
    assert.ok(messages.slice(0, first).every((m) => m.x === 0 && m.epoch === epoch));
    assert.ok(messages.slice(first).every((m) => m.x === 1));
  });

  test("does not move the robot while the gate is not armed", () => {
    bench.arming = false;
    bench.press();
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
  });

  test("does not move the robot before neutral is acknowledged", () => {
    bench.acking = false;
    bench.press();
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(250)), []);
    bench.ack = bench.sent.at(-1).seq;
    assert.deepEqual(moves(bench.run(200)), []);
  });

  test("does nothing on a robot of another operator", () => {
    bench.report("r1", {
      holder: { connection: "c2", name: "Ann" },
      epoch: 9,
      state: "held",
    });
    assert.deepEqual(bench.press(), []);
    bench.report("r1");
    assert.deepEqual(bench.run(500), [], "the other operator released control");
  });

  test("does nothing on a robot that cannot be driven", () => {
    bench.report("r1", { armable: false, reason: "link down" });
    assert.deepEqual(bench.press(), []);
  });

  test("takes control from a program, and only a new press drives", () => {
    bench.report("r1", {
      holder: { connection: "program", name: "program" },
      epoch: 9,
      state: "held",
    });
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r1" }]);
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
    bench.letGo();
    bench.run(250);
    assert.equal(moves(bench.press()).length, 1);
  });

  test("is given up when the gate does not answer", () => {
    bench.press();
    bench.run(TAKE_PATIENCE + 100);
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
  });

  test("is given up when the gate refuses", () => {
    bench.press();
    bench.pilot.refuse("r1", "take", "Ann has control", bench.now);
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
    assert.equal(bench.pilot.status.refusal, "Ann has control");
  });
});

describe("while a robot is driven", () => {
  test("every step sends a command with the newest tick and the next number", () => {
    bench.drive();
    const messages = bench.run(200);
    assert.equal(messages.length, 4);
    messages.reduce((last, m) => (assert.equal(m.seq, last.seq + 1), m));
    assert.equal(messages.at(-1).tick, bench.tick);
  });

  test("a release is neutral at once, and a new press moves at once", () => {
    bench.drive();
    assert.equal(bench.letGo().at(-1).x, 0);
    assert.equal(bench.press().at(-1).x, 1);
  });

  for (const [what, happen] of [
    [
      "the page loses attention",
      () => {
        bench.attentive = false;
        bench.step();
        bench.attentive = true;
      },
    ],
    [
      "the page slept",
      () => {
        bench.step(400);
      },
    ],
    [
      "the clock jumps ahead",
      () => {
        bench.step(3_600_000);
      },
    ],
    [
      "the gate disarms",
      () => {
        bench.report("r1", {
          mine: true,
          epoch: bench.epoch,
          armed: false,
          state: "stopping",
          holder: { connection: "c1", name: "me" },
        });
        bench.grant("r1", bench.epoch);
      },
    ],
    [
      "the gate refuses a command",
      () => {
        bench.pilot.refuse("r1", "drive", "too old", bench.now);
      },
    ],
    [
      "acknowledgements stay away",
      () => {
        bench.acking = false;
        bench.run(400);
        bench.acking = true;
      },
    ],
    [
      "ticks stay away",
      () => {
        bench.ticking = false;
        bench.run(350);
        bench.ticking = true;
      },
    ],
    [
      "the lease is lost and comes again",
      () => {
        bench.report("r1");
        bench.grant("r1");
      },
    ],
  ]) {
    test(`a held key does not resume motion when ${what}`, () => {
      bench.drive();
      happen();
      bench.run(100);
      // A held key that is reported again is not a new press.
      bench.inputs.set("keys", FORWARD, bench.now);
      assert.deepEqual(moves(bench.run(1500)), []);
    });
  }

  test("after an input block, a release and a new press drive again", () => {
    bench.drive();
    bench.pilot.goNeutral(bench.now);
    bench.run(300);
    bench.letGo();
    bench.run(300);
    assert.equal(moves(bench.press()).length, 1);
  });

  test("after an input block, a new press waits for acknowledged neutral commands", () => {
    bench.drive();
    bench.letGo();
    bench.run(300);
    bench.pilot.goNeutral(bench.now);
    bench.acking = false;
    bench.run(200);
    assert.deepEqual(moves(bench.press()), []);
  });

  test("the stream sends neutral commands while the loop is late", () => {
    bench.drive();
    bench.acking = false;
    assert.ok(moves(bench.run(1000)).length <= 7);
    assert.equal(bench.sent.at(-1).op, "drive", "the stream is not ended");
  });
});

describe("a new selection", () => {
  test("sends neutral and then releases the driven robot", () => {
    bench.drive();
    const messages = bench.pilot.choose("r2", bench.now);
    assert.deepEqual(
      messages.map((m) => [m.op, m.robot, m.x]),
      [
        ["drive", "r1", 0],
        ["release", "r1", undefined],
      ],
    );
  });

  test("does not let a held key drive the new robot", () => {
    bench.drive();
    bench.keep(bench.pilot.choose("r2", bench.now));
    assert.deepEqual(bench.run(1000), []);
    bench.letGo();
    bench.run(250);
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r2" }]);
  });

  test("releases a requested lease that was not granted yet", () => {
    bench.press();
    assert.deepEqual(bench.pilot.choose("r2", bench.now), [
      { op: "release", robot: "r1" },
    ]);
    bench.grant("r1");
    assert.deepEqual(bench.run(500), []);
  });

  test("does not let a key pressed without a selection drive the new robot", () => {
    bench.keep(bench.pilot.choose(null, bench.now));
    bench.press();
    bench.keep(bench.pilot.choose("r2", bench.now));
    assert.deepEqual(bench.run(500), []);
  });

  test("of no robot leaves no robot to drive", () => {
    bench.drive();
    bench.keep(bench.pilot.choose(null, bench.now));
    bench.letGo();
    bench.run(500);
    assert.deepEqual(bench.press(), []);
  });
});

describe("leases", () => {
  test("are released after a time without motion", () => {
    bench = new Bench({ releaseAfter: 5000 });
    bench.drive();
    bench.letGo();
    const messages = bench.run(5100);
    assert.equal(messages.filter((m) => m.op === "release").length, 1);
    assert.equal(bench.pilot.driven, null);
  });

  test("are not released while a key is held", () => {
    bench = new Bench({ releaseAfter: 5000 });
    bench.drive();
    assert.ok(bench.run(10_000).every((m) => m.op === "drive"));
  });

  test("that were released are not restored by a late report", () => {
    const epoch = bench.drive();
    bench.letGo();
    bench.keep(bench.pilot.release("r1", bench.now));
    bench.grant("r1", epoch);
    bench.run(250);
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r1" }]);
  });

  test("taken without a key do not let a held key drive", () => {
    bench.press({ x: 0, y: 0, turn: 0 });
    bench.keep(bench.pilot.take("r1", bench.now));
    bench.inputs.set("keys", FORWARD, bench.now);
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
  });

  test("for a goal are kept without commands and released later", () => {
    bench = new Bench({ releaseAfter: 5000 });
    const epoch = bench.grant("r1");
    const goal = bench.pilot.place("goal", "r1", { x: 1, y: 2, yaw: 0 }, bench.now);
    assert.deepEqual([goal.op, goal.epoch], ["goal", epoch]);
    assert.deepEqual(bench.run(4900), []);
    assert.deepEqual(bench.run(200), [{ op: "release", robot: "r1" }]);
  });

  test("for a route are renewed regularly while the route runs", () => {
    bench = new Bench({ releaseAfter: 5000 });
    const epoch = bench.grant("r1");
    bench.pilot.place("goal", "r1", { x: 1, y: 2, yaw: 0 }, bench.now);
    for (let t = 0; t < 25_000; t += 50) {
      bench.keep(bench.pilot.keep("r1", bench.now));
      bench.step();
    }
    const renew = { op: "renew", robot: "r1", epoch };
    assert.deepEqual(bench.sent, [renew, renew, renew]);
  });

  test("that this page does not have are not renewed", () => {
    assert.deepEqual(bench.pilot.keep("r1", bench.now), []);
  });

  test("end with a STOP, after which no command is sent and no refusal is shown", () => {
    const epoch = bench.drive();
    bench.pilot.stopped("r1", bench.now);
    bench.grant("r1", epoch);
    assert.deepEqual(bench.run(500), []);
    bench.pilot.refuse("r1", "drive", "no operator has control", bench.now);
    assert.equal(bench.pilot.status.refusal, null);
  });

  test("do not end with a STOP of another robot, but the inputs are blocked", () => {
    bench.drive();
    bench.pilot.stopped("r2", bench.now);
    assert.equal(bench.pilot.driven, "r1");
    assert.deepEqual(moves(bench.run(500)), [], "the inputs are blocked");
  });

  test("end with the connection", () => {
    bench.drive();
    bench.pilot.disconnect();
    assert.deepEqual(bench.run(200), []);
    assert.equal(bench.pilot.epoch("r1"), null);
  });
});

describe("a robot of another operator", () => {
  const holder = { connection: "c9", name: "Ann" };

  test("is neutral after a granted request until a new press", () => {
    bench.report("r1", { holder, epoch: 3, state: "held" });
    bench.keep(bench.pilot.ask("r1"));
    bench.press();
    bench.grant("r1");
    const messages = bench.run(600);
    assert.ok(messages.length > 0);
    assert.deepEqual(moves(messages), []);
    bench.letGo();
    bench.run(250);
    bench.press();
    assert.ok(moves(bench.run(100)).length > 0);
  });

  test("is released after a time if another robot was selected before the grant", () => {
    bench = new Bench({ releaseAfter: 5000 });
    bench.report("r1", { holder, epoch: 3, state: "held" });
    bench.keep(bench.pilot.ask("r1"));
    bench.keep(bench.pilot.choose("r2", bench.now));
    bench.grant("r1");
    assert.deepEqual(bench.run(4900), []);
    assert.deepEqual(bench.run(200), [{ op: "release", robot: "r1" }]);
  });

  test("is not driven after a refused request, and the reason is shown", () => {
    bench.report("r1", { holder, epoch: 3, state: "held" });
    bench.keep(bench.pilot.ask("r1"));
    bench.pilot.refuse("r1", "ask", "Ann keeps it", bench.now);
    assert.equal(bench.pilot.status.refusal, "Ann keeps it");
    bench.grant("r1");
    assert.deepEqual(bench.run(200), []);
  });
});

describe("a robot whose control is handed over", () => {
  test("receives neutral first, and a held key has no effect afterwards", () => {
    bench.drive();
    const [neutral, grant] = bench.keep(bench.pilot.grant("r1", bench.now));
    assert.deepEqual([neutral.x, neutral.turn], [0, 0]);
    assert.deepEqual(grant, { op: "grant", robot: "r1" });
    assert.deepEqual(moves(bench.run(600)), []);
  });

  test("can be driven by a new press until the gate reports a change of control", () => {
    bench.drive();
    bench.keep(bench.pilot.grant("r1", bench.now));
    bench.letGo();
    bench.run(600);
    bench.press();
    assert.ok(moves(bench.run(100)).length > 0);
  });
});

describe("a robot with an active STOP", () => {
  test("is taken neither by a press nor by a key held during its Reset", () => {
    bench.report("r1", { state: "stopped", latched: true });
    bench.press();
    bench.run(300);
    bench.pilot.reset("r1", bench.now);
    bench.report("r1", { latched: false });
    assert.deepEqual(bench.run(500), []);
    bench.letGo();
    bench.run(250);
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r1" }]);
  });
});

describe("a camera that is used for driving", () => {
  const last = () => bench.sent.filter((m) => m.op === "drive").at(-1);

  test("adds the age of its picture to each command only while in use", () => {
    const end = bench.pilot.pictures.goBy("r1", () => 123.4);
    bench.drive();
    assert.equal(last().video, 123);
    end();
    bench.run(50);
    assert.ok(!("video" in last()));
  });

  test("of another robot adds nothing to the commands", () => {
    bench.pilot.pictures.goBy("r2", () => 9999);
    bench.drive();
    assert.ok(!("video" in last()));
  });

  test("stops the robot when its picture freezes, until a release and a new press", () => {
    let age = 100;
    bench.pilot.pictures.goBy("r1", () => age);
    bench.drive();
    age = 1001;
    assert.deepEqual(moves(bench.run(500)), []);
    assert.equal(last().video, 1001);
    age = 100;
    assert.deepEqual(moves(bench.run(1000)), []);
    bench.letGo();
    bench.run(300);
    assert.equal(moves(bench.press()).length, 1);
  });

  test("without any picture sends the largest age and no motion", () => {
    bench.pilot.pictures.goBy("r1", () => Infinity);
    bench.press();
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
    assert.equal(last().video, 1e9);
  });
});

describe("a stop test", () => {
  const TEST = [{ op: "stop-test", robot: "r1" }];
  const tests = (messages) => messages.filter(({ op }) => op === "stop-test");

  test("under control taken for a goal begins after neutral commands", () => {
    bench.grant("r1");
    bench.pilot.place("goal", "r1", { x: 1, y: 2, yaw: 0 }, bench.now);
    assert.deepEqual(bench.run(500), []);
    bench.pilot.stopTest("r1", bench.now);
    const messages = bench.run(600);
    const before = messages.slice(0, messages.findIndex(({ op }) => op === "stop-test"));
    assert.ok(before.length >= 5 && before.every(({ op, x }) => op === "drive" && x === 0));
    assert.deepEqual(tests(messages), TEST);
  });

  test("does not begin while an input is held, and the page says why", () => {
    bench.drive();
    bench.pilot.stopTest("r1", bench.now);
    assert.deepEqual(tests(bench.run(2000)), []);
    assert.equal(bench.pilot.status.refusal, "release all inputs first");
  });

  test("does not begin after an input was pressed, STOP, or another choice", () => {
    for (const act of [
      () => bench.press(),
      () => bench.pilot.stopped("r1", bench.now),
      () => bench.pilot.choose("r2", bench.now),
      () => bench.pilot.goNeutral(bench.now, { drop: true }),
    ]) {
      bench = new Bench();
      bench.grant("r1");
      bench.pilot.stopTest("r1", bench.now);
      bench.run(100);
      act();
      assert.deepEqual(tests(bench.run(2000)), []);
    }
  });

  test("that the gate does not prepare for is requested anyway, for its reason", () => {
    bench.arming = false;
    bench.grant("r1");
    bench.pilot.stopTest("r1", bench.now);
    assert.deepEqual(tests(bench.run(1400)), []);
    assert.deepEqual(tests(bench.run(200)), TEST);
  });
});
