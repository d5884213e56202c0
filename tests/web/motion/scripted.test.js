import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import { test } from "node:test";

import { describe } from "../../../src/webmap/web/motion/status.js";
import { Bench } from "./pilot_bench.js";

/**
 * Digests of what a page sends and shows for each script of random inputs.
 *
 * WEBMAP_SCRIPTED=write node --test tests/web/motion/scripted.test.js writes the file;
 * with WEBMAP_SCRIPTED=print each step is printed.
 */
const FILE = new URL("scripted.json", import.meta.url);
const MODE = process.env.WEBMAP_SCRIPTED ?? "";
const SCRIPTS = 40;
const STEPS = 60;

const AXES = [
  { x: 1, y: 0, turn: 0 },
  { x: -1, y: 0, turn: 0 },
  { x: 0, y: 0.5, turn: 0 },
  { x: 0.3, y: 0, turn: -1 },
];

const PARTS = ["take", "drive", "ask", "goal"];
const OTHER = {
  holder: { connection: "c2", name: "Ann" },
  state: "driving",
  doing: "driven",
  epoch: 3,
};
const STOPPED = { state: "stopped", doing: "stopped", latched: true };
const BARRED = { armable: false, doing: "barred", reason: "no odometry" };
const POSE = { x: 1, y: 2, yaw: 0.5 };

/** @typedef {<T>(from: T[]) => T} Pick */

/**
 * Random events of the inputs, the gate and the connection.
 *
 * @type {Record<string, (bench: Bench, pick: Pick) => any>}
 */
const EVENTS = {
  driveOff: (bench) => driveOff(bench),
  press: (bench, pick) => void bench.press(pick(AXES)),
  letGo: (bench) => void bench.letGo(),
  run: (bench, pick) => void bench.run(pick([50, 200, 600])),
  wait: (bench) => void bench.run(31_000),
  attention: (bench, pick) => void (bench.attentive = pick([true, true, false])),
  ticks: (bench, pick) => void (bench.ticking = pick([true, true, false])),
  acks: (bench, pick) => void (bench.acking = pick([true, true, false])),
  arming: (bench, pick) => void (bench.arming = pick([true, true, false])),
  granted: (bench, pick) => void bench.grant(pick(["r1", "r1", "r2"])),
  stopped: (bench) => bench.report("r1", STOPPED),
  other: (bench) => bench.report("r1", OTHER),
  free: (bench, pick) => bench.report(pick(["r1", "r2"])),
  barred: (bench) => bench.report("r1", BARRED),
  choose: ({ pilot, now }, pick) => pilot.choose(pick(["r1", "r1", "r2", null]), now),
  take: ({ pilot, now }, pick) => pilot.take(pick(["r1", "r2"]), now),
  ask: ({ pilot }) => pilot.ask("r1"),
  grant: ({ pilot, now }) => pilot.grant("r1", now),
  release: ({ pilot, now }, pick) => pilot.release(pick(["r1", "r2"]), now),
  goal: ({ pilot, now }, pick) => [pilot.place("goal", pick(["r1", "r2"]), POSE, now)],
  locate: ({ pilot, now }) => [pilot.place("locate", "r1", POSE, now)],
  keep: ({ pilot, now }, pick) => pilot.keep(pick(["r1", "r2"]), now),
  doubt: ({ pilot, now }, pick) => pilot.goNeutral(now, { drop: pick([true, false]) }),
  stop: ({ pilot, now }, pick) => pilot.stopped(pick(["r1", "*"]), now),
  reset: ({ pilot, now }) => pilot.reset("r1", now),
  disconnect: ({ pilot }) => pilot.disconnect(),
  gone: ({ pilot, now }) => pilot.gone("r1", now),
  refused: ({ pilot, now }, pick) => pilot.refuse("r1", pick(PARTS), "no", now),
};
const NAMES = [...Object.keys(EVENTS), ...Array(6).fill("driveOff"), "letGo", "letGo"];

/** @param {Bench} bench */
function driveOff(bench) {
  bench.attentive = bench.ticking = bench.acking = bench.arming = true;
  bench.letGo();
  bench.report("r1");
  bench.pilot.choose("r1", bench.now);
  bench.run(400);
  bench.press();
  const epoch = bench.grant("r1");
  bench.run(300);
  const holder = { connection: "c1", name: "me" };
  const driven = { state: "driving", doing: "driven", armed: true };
  bench.report("r1", { holder, mine: true, epoch, ...driven });
  bench.run(300);
}

/** @param {number} seed */
function chooser(seed) {
  let state = seed;
  return (from) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return from[Math.floor((state / 2 ** 32) * from.length)];
  };
}

/** @param {number} seed */
function digestOf(seed) {
  const pick = chooser(seed);
  const bench = new Bench();
  const hash = createHash("sha256");
  for (let step = 0; step < STEPS; step++) {
    const name = pick(NAMES);
    const before = bench.sent.length;
    bench.keep(EVENTS[name](bench, pick) ?? []);
    bench.step();
    const { status } = bench.pilot;
    const report = bench.pilot.robots?.get("r1") ?? null;
    const open = /** @type {any} */ ({ link: "open", ...status });
    const shown = describe(open, "r1", report, true);
    const line = JSON.stringify([name, bench.now, bench.sent.slice(before), status, shown]);
    if (MODE === "print") process.stdout.write(`${seed} ${line}\n`);
    hash.update(line);
  }
  return hash.digest("hex").slice(0, 12);
}

test("scripted inputs give the recorded commands and texts", () => {
  const found = Array.from({ length: SCRIPTS }, (_, seed) => digestOf(seed + 1));
  if (MODE === "write") writeFileSync(FILE, `${JSON.stringify(found, null, 0)}\n`);
  assert.deepEqual(found, JSON.parse(readFileSync(FILE, "utf8")));
});
