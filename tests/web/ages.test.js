import assert from "node:assert/strict";
import { test } from "node:test";

import { Ages, DisplayClock } from "../../src/webmap/web/ages.js";

class FakeItem {
  constructor() {
    this.written = 0;
    this.stale = null;
    this.crowd = null;
    this.element = { classList: { toggle: (_, on) => (this.stale = on) } };
  }

  showAge() {
    this.written++;
  }
}

/** Ages of `count` items that are measured now, with a clock that starts at 0. */
function agesOf(t, count) {
  let now = 0;
  t.mock.timers.enable({ apis: ["setInterval"] });
  t.mock.method(performance, "now", () => now);
  const clock = new DisplayClock();
  clock.update(0, 0);
  const ages = new Ages(clock, () => {});
  const items = Array.from({ length: count }, () => new FakeItem());
  for (const item of items) ages.set(item, 1);
  ages.flush();
  const wait = (ms) => {
    for (let step = 0; step < ms / 250; step++) {
      now += 250;
      t.mock.timers.tick(250);
    }
  };
  return { ages, items, wait };
}

test("few ages are written four times a second, many only twice", (t) => {
  for (const [count, times] of [
    [200, 4],
    [500, 2],
  ]) {
    const { ages, items, wait } = agesOf(t, count);
    const before = items[0].written;
    wait(750); // not yet stale
    wait(250);
    assert.equal(items[0].written - before, times);
    ages.stop();
    t.mock.reset();
    t.mock.timers.reset();
  }
});

test("many ages become stale as early as few", (t) => {
  const { ages, items, wait } = agesOf(t, 500);
  wait(1000);
  assert.equal(items[499].stale, false);
  wait(250);
  assert.equal(items[499].stale, true);
  ages.stop();
});
