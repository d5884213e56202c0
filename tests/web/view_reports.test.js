import assert from "node:assert/strict";
import test from "node:test";

import { REPORT_PERIOD, ViewReports } from "../../src/webmap/web/view.js";

/**
 * @param {number} count
 * @returns {{reports: ViewReports, times: number[], all: Promise<void>}} The reporter,
 *     the times of its reports, and a promise that ends after `count` reports.
 */
function reporting(count) {
  const times = [];
  let end = () => {};
  const all = new Promise((resolve) => {
    end = () => resolve(undefined);
  });
  const reports = new ViewReports(() => {
    times.push(performance.now());
    if (times.length === count) end();
  });
  return { reports, times, all };
}

test("a change is reported soon, and the next report waits for the report period", async () => {
  const first = reporting(1);
  first.reports.soon();
  first.reports.soon();
  assert.equal(first.times.length, 0);
  await first.all;

  const second = reporting(2);
  second.reports.soon();
  second.reports.settle();
  second.reports.soon();
  await second.all;
  // By this clock, timers may end a millisecond early.
  assert.ok(second.times[1] - second.times[0] >= REPORT_PERIOD - 2);
});

test("a frame reports a change once", () => {
  const { reports, times } = reporting(1);
  reports.settle();
  assert.equal(times.length, 0, "nothing changed");
  reports.note();
  reports.settle();
  reports.settle();
  assert.equal(times.length, 1);
});

test("the timer does not report a change again that a frame reported", async () => {
  const { reports, times } = reporting(2);
  reports.soon();
  reports.settle();
  await new Promise((resolve) => setTimeout(resolve, 5));
  assert.equal(times.length, 1);
});

test("a removed map reports nothing", async () => {
  const { reports, times } = reporting(1);
  reports.soon();
  reports.end();
  await new Promise((resolve) => setTimeout(resolve, 5));
  assert.equal(times.length, 0);
});
