import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { gzipSync } from "node:zlib";

/** A socket without a network: it never opens. */
class Hanging {
  static CONNECTING = 0;
  static OPEN = 1;
  static CLOSED = 3;
  static made = [];

  constructor() {
    this.readyState = Hanging.CONNECTING;
    this.closed = false;
    Hanging.made.push(this);
  }

  addEventListener() {}

  close() {
    this.closed = true;
  }
}

const online = [];
globalThis.addEventListener = (_, fn) => online.push(fn);
globalThis.WebSocket = Hanging;
const { AnswerPace } = await import("../../src/webmap/web/frames.js");
const { Link } = await import("../../src/webmap/web/link.js");
const { unpacked } = await import("../../src/webmap/web/packed.js");

function makeLink(t, first) {
  Hanging.made = [];
  mock.timers.enable({ apis: ["setTimeout"] });
  t.after(() => mock.timers.reset());
  const reported = [];
  const events = {
    opened: () => reported.push("opened"),
    received: (data, at) => reported.push([data.byteLength, at]),
    closed: (reason) => reported.push(reason),
    refused: () => {},
  };
  return { link: new Link(() => new URL("ws://localhost/"), events, first), reported };
}

test("a link that does not open is opened again with a longer timeout", (t) => {
  const now = t.mock.method(performance, "now", () => 0).mock;
  const { link, reported } = makeLink(t);
  const looksAt = (ms) => {
    now.mockImplementation(() => ms);
    link.look();
  };
  looksAt(4900);
  assert.deepEqual(reported, []);
  looksAt(5000);
  assert.deepEqual(reported, ["no answer"]);
  assert.ok(Hanging.made[0].closed);
  mock.timers.tick(1000);
  looksAt(14_900);
  assert.equal(reported.length, 1);
  looksAt(15_000);
  assert.equal(reported.length, 2);
  assert.ok(!link.opens);
});

test("a new connection replaces a pending one when the network is back", (t) => {
  makeLink(t);
  online.at(-1)();
  assert.ok(Hanging.made[0].closed);
  assert.equal(Hanging.made.length, 2);
});

/** @returns A socket that was opened before the link was made, with two messages. */
function firstSocket(readyState) {
  const received = [
    { data: Promise.resolve(new ArrayBuffer(3)), at: 20 },
    { data: Promise.resolve(new ArrayBuffer(4)), at: 70 },
  ];
  return { socket: Object.assign(new Hanging(), { readyState }), received };
}

test("a link takes over an open socket, and what came before with its times", async (t) => {
  const { link, reported } = makeLink(t, firstSocket(Hanging.OPEN));
  assert.ok(link.isOpen);
  assert.deepEqual(reported, [], "events come after the constructor");
  await until(reported, 3);
  assert.deepEqual(reported, ["opened", [3, 20], [4, 70]]);
});

/** @returns A link whose first socket received these messages, and its reports. */
async function linkWith(t, messages) {
  const received = messages.map((data, at) => ({
    data: unpacked(Uint8Array.from(data).buffer),
    at,
  }));
  const socket = Object.assign(new Hanging(), { readyState: Hanging.OPEN });
  const made = makeLink(t, { socket, received });
  await Promise.resolve();
  return made;
}

/** Wait for a number of reports. */
async function until(reported, count) {
  for (let turns = 0; reported.length < count && turns < 10_000; turns++) {
    await new Promise((done) => setImmediate(done));
  }
}

test("messages after a compressed one wait for it", async (t) => {
  const messages = [gzipSync(new Uint8Array(5000)), [1, 2, 3], [4, 5]];
  const { reported } = await linkWith(t, messages);
  await until(reported, 4);
  assert.deepEqual(reported, ["opened", [5000, 0], [3, 1], [2, 2]]);
});

test("a compressed message that is damaged is passed on as it came", async (t) => {
  const damaged = gzipSync(new Uint8Array(5000)).subarray(0, 12);
  const { reported } = await linkWith(t, [damaged, [1]]);
  await until(reported, 3);
  assert.deepEqual(reported, ["opened", [12, 0], [1, 1]]);
});

test("a compressed message of a lost connection is dropped", async (t) => {
  const { link, reported } = await linkWith(t, [gzipSync(new Uint8Array(5000))]);
  link.renew();
  await until(reported, 3);
  assert.deepEqual(reported, ["opened", "no answer"]);
});

test("a link waits for a first socket that still opens", async (t) => {
  const { link, reported } = makeLink(t, firstSocket(Hanging.CONNECTING));
  assert.ok(link.opens);
  await Promise.resolve();
  assert.deepEqual(reported, []);
  assert.equal(Hanging.made.length, 0);
});

test("a link replaces a first socket that has closed", (t) => {
  const { link } = makeLink(t, firstSocket(Hanging.CLOSED));
  assert.ok(link.opens);
  assert.equal(Hanging.made.length, 1);
});

test("a page answers at once while drawing is cheap, and later the more it costs", () => {
  const pace = new AnswerPace();
  assert.equal(pace.pause, 0);
  for (const [cost, pause] of [[3, 0], [6, 18], [12.5, 37.5], [25, 25], [40, 40]]) {
    for (let frame = 0; frame < 60; frame += 1) pace.drawn(cost);
    assert.ok(Math.abs(pace.pause - pause) < 0.1, `${cost}: ${pace.pause}`);
  }
  pace.drawn(60_000); // the page was not shown meanwhile
  assert.ok(pace.pause < 60);
});
