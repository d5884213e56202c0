import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

import { TAKE_PATIENCE } from "../../../src/webmap/web/motion/lease_requests.js";
import { Bench, FORWARD } from "./pilot_bench.js";

const moves = (messages) =>
  messages.filter((m) => m.op === "drive" && (m.x !== 0 || m.y !== 0 || m.turn !== 0));

/** @type {Bench} */
let bench;
beforeEach(() => {
  bench = new Bench();
});

describe("the first press", () => {
  test("takes a free robot and nothing more", () => {
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r1" }]);
    assert.deepEqual(bench.run(200), []);
  });

  test("takes effect after neutral that the gate has seen for 200 ms", () => {
    bench.press();
    const epoch = bench.grant("r1");
    const messages = bench.run(600);
    const first = messages.findIndex((m) => m.x === 1);
    assert.ok(first >= 5, `${first} neutral commands came first`);
    assert.ok(messages.slice(0, first).every((m) => m.x === 0 && m.epoch === epoch));
    assert.ok(messages.slice(first).every((m) => m.x === 1));
  });

  test("waits for the gate to say that it is armed", () => {
    bench.arming = false;
    bench.press();
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
  });

  test("waits for the acknowledgement of neutral, however long the way", () => {
    bench.acking = false;
    bench.press();
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(250)), []);
    bench.ack = bench.sent.at(-1).seq;
    assert.deepEqual(moves(bench.run(200)), []);
  });

  test("does nothing on a robot that somebody else drives", () => {
    bench.say("r1", {
      holder: { connection: "c2", name: "Ann" },
      epoch: 9,
      state: "held",
    });
    assert.deepEqual(bench.press(), []);
    bench.say("r1");
    assert.deepEqual(bench.run(500), [], "nor when that one lets go");
  });

  test("does nothing on a robot that cannot be driven", () => {
    bench.say("r1", { armable: false, reason: "link down" });
    assert.deepEqual(bench.press(), []);
  });

  test("reaches over a program, and then asks for a new press", () => {
    bench.say("r1", {
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

describe("while driving", () => {
  test("the state goes out at every step with the newest tick and a growing number", () => {
    bench.drive();
    const messages = bench.run(200);
    assert.equal(messages.length, 4);
    messages.reduce((last, m) => (assert.equal(m.seq, last.seq + 1), m));
    assert.equal(messages.at(-1).tick, bench.tick);
  });

  test("a release is neutral at once, and a press moves again at once", () => {
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
        bench.say("r1", {
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
        bench.say("r1");
        bench.grant("r1");
      },
    ],
  ]) {
    test(`nothing resumes when ${what}`, () => {
      bench.drive();
      happen();
      bench.run(100);
      // A key that is held and says so again is still not a new press.
      bench.inputs.set("keys", FORWARD, bench.now);
      assert.deepEqual(moves(bench.run(1500)), []);
    });
  }

  test("after a doubt, a release and a new press drive again", () => {
    bench.drive();
    bench.pilot.goNeutral(bench.now);
    bench.run(300);
    bench.letGo();
    bench.run(300);
    assert.equal(moves(bench.press()).length, 1);
  });

  test("after a doubt, a new press waits for neutral that the gate has seen", () => {
    bench.drive();
    bench.letGo();
    bench.run(300);
    bench.pilot.goNeutral(bench.now);
    bench.acking = false;
    bench.run(200);
    assert.deepEqual(moves(bench.press()), []);
  });

  test("the stream stays neutral while the loop is late", () => {
    bench.drive();
    bench.acking = false;
    assert.ok(moves(bench.run(1000)).length <= 7);
    assert.equal(bench.sent.at(-1).op, "drive", "and goes on, to be found alive again");
  });
});

describe("another choice", () => {
  test("lets go of the driven robot, neutral first", () => {
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

  test("is not driven by what is held", () => {
    bench.drive();
    bench.keep(bench.pilot.choose("r2", bench.now));
    assert.deepEqual(bench.run(1000), []);
    bench.letGo();
    bench.run(250);
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r2" }]);
  });

  test("gives back a lease that is on its way", () => {
    bench.press();
    assert.deepEqual(bench.pilot.choose("r2", bench.now), [
      { op: "release", robot: "r1" },
    ]);
    bench.grant("r1");
    assert.deepEqual(bench.run(500), []);
  });

  test("is not driven by what was pressed while none was chosen", () => {
    bench.keep(bench.pilot.choose(null, bench.now));
    bench.press();
    bench.keep(bench.pilot.choose("r2", bench.now));
    assert.deepEqual(bench.run(500), []);
  });

  test("of nothing leaves nothing to drive", () => {
    bench.drive();
    bench.keep(bench.pilot.choose(null, bench.now));
    bench.letGo();
    bench.run(500);
    assert.deepEqual(bench.press(), []);
  });
});

describe("leases", () => {
  test("are given back after a while without motion", () => {
    bench = new Bench({ releaseAfter: 5000 });
    bench.drive();
    bench.letGo();
    const messages = bench.run(5100);
    assert.equal(messages.filter((m) => m.op === "release").length, 1);
    assert.equal(bench.pilot.driven, null);
  });

  test("are not given back while something is held", () => {
    bench = new Bench({ releaseAfter: 5000 });
    bench.drive();
    assert.ok(bench.run(10_000).every((m) => m.op === "drive"));
  });

  test("that were given back are not believed in by a late report", () => {
    const epoch = bench.drive();
    bench.letGo();
    bench.keep(bench.pilot.release("r1", bench.now));
    bench.grant("r1", epoch);
    bench.run(250);
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r1" }]);
  });

  test("asked for by name do not move by what is held", () => {
    bench.press({ x: 0, y: 0, turn: 0 });
    bench.keep(bench.pilot.take("r1", bench.now));
    bench.inputs.set("keys", FORWARD, bench.now);
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
  });

  test("for a goal are kept quietly and given back later", () => {
    bench = new Bench({ releaseAfter: 5000 });
    const epoch = bench.grant("r1");
    const goal = bench.pilot.place("goal", "r1", { x: 1, y: 2, yaw: 0 }, bench.now);
    assert.deepEqual([goal.op, goal.epoch], ["goal", epoch]);
    assert.deepEqual(bench.run(4900), []);
    assert.deepEqual(bench.run(200), [{ op: "release", robot: "r1" }]);
  });

  test("that serve a route are renewed now and then, as long as that goes on", () => {
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

  test("end with a STOP, at once and without a word", () => {
    const epoch = bench.drive();
    bench.pilot.stopped("r1", bench.now);
    bench.grant("r1", epoch);
    assert.deepEqual(bench.run(500), []);
    bench.pilot.refuse("r1", "drive", "no operator has control", bench.now);
    assert.equal(bench.pilot.status.refusal, null);
  });

  test("on other robots do not end with the STOP of one", () => {
    bench.drive();
    bench.pilot.stopped("r2", bench.now);
    assert.equal(bench.pilot.driven, "r1");
    assert.deepEqual(moves(bench.run(500)), [], "but the inputs are dead");
  });

  test("end with the connection", () => {
    bench.drive();
    bench.pilot.disconnect();
    assert.deepEqual(bench.run(200), []);
    assert.equal(bench.pilot.epoch("r1"), null);
  });
});

describe("a robot that another holds", () => {
  const holder = { connection: "c9", name: "Ann" };

  test("that was asked for comes neutral, and not by what is held", () => {
    bench.say("r1", { holder, epoch: 3, state: "held" });
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

  test("that comes when the operator has turned to another is given back in time", () => {
    bench = new Bench({ releaseAfter: 5000 });
    bench.say("r1", { holder, epoch: 3, state: "held" });
    bench.keep(bench.pilot.ask("r1"));
    bench.keep(bench.pilot.choose("r2", bench.now));
    bench.grant("r1");
    assert.deepEqual(bench.run(4900), []);
    assert.deepEqual(bench.run(200), [{ op: "release", robot: "r1" }]);
  });

  test("is not believed to be ours by an ask that was refused", () => {
    bench.say("r1", { holder, epoch: 3, state: "held" });
    bench.keep(bench.pilot.ask("r1"));
    bench.pilot.refuse("r1", "ask", "Ann keeps it", bench.now);
    assert.equal(bench.pilot.status.refusal, "Ann keeps it");
    bench.grant("r1");
    assert.deepEqual(bench.run(200), []);
  });
});

describe("a robot that is handed over", () => {
  test("is given neutral first, and what is held means nothing from then on", () => {
    bench.drive();
    const [neutral, grant] = bench.keep(bench.pilot.grant("r1", bench.now));
    assert.deepEqual([neutral.x, neutral.turn], [0, 0]);
    assert.deepEqual(grant, { op: "grant", robot: "r1" });
    assert.deepEqual(moves(bench.run(600)), []);
  });

  test("stays ours, to be driven by a new press, while the gate does not say otherwise", () => {
    bench.drive();
    bench.keep(bench.pilot.grant("r1", bench.now));
    bench.letGo();
    bench.run(600);
    bench.press();
    assert.ok(moves(bench.run(100)).length > 0);
  });
});

describe("a robot for which a STOP stands", () => {
  test("is not taken by a press, nor by one that is held through its reset", () => {
    bench.say("r1", { state: "stopped", latched: true });
    bench.press();
    bench.run(300);
    bench.pilot.reset("r1", bench.now);
    bench.say("r1", { latched: false });
    assert.deepEqual(bench.run(500), []);
    bench.letGo();
    bench.run(250);
    assert.deepEqual(bench.press(), [{ op: "take", robot: "r1" }]);
  });
});

describe("a camera that the operator goes by", () => {
  const last = () => bench.sent.filter((m) => m.op === "drive").at(-1);

  test("is spoken of in each command, and only while there is one", () => {
    const end = bench.pilot.pictures.goBy("r1", () => 123.4);
    bench.drive();
    assert.equal(last().video, 123);
    end();
    bench.run(50);
    assert.ok(!("video" in last()));
  });

  test("of another robot says nothing of this one", () => {
    bench.pilot.pictures.goBy("r2", () => 9999);
    bench.drive();
    assert.ok(!("video" in last()));
  });

  test("stops the robot when it freezes, until inputs are off and press again", () => {
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

  test("that never had a picture is as old as a number can tell", () => {
    bench.pilot.pictures.goBy("r1", () => Infinity);
    bench.press();
    bench.grant("r1");
    assert.deepEqual(moves(bench.run(600)), []);
    assert.equal(last().video, 1e9);
  });
});
