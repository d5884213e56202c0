import assert from "node:assert/strict";
import { test } from "node:test";

import { headline, span } from "../../../src/webmap/features/alerts/alert_panel.js";
import { Pace } from "../../../src/webmap/features/alerts/alert_signal.js";

const KINDS = { lost: "lost", battery: "battery low" };

/** @param {...string} kinds */
const alerts = (...kinds) => /** @type {any[]} */ (kinds.map((kind) => ({ kind })));

test("the headline counts the new alerts of each kind, the most urgent first", () => {
  assert.equal(headline([], KINDS), "No new alerts.");
  assert.equal(headline(alerts("battery"), KINDS), "1 new alert: 1 battery low.");
  assert.equal(
    headline(alerts("battery", "lost", "lost"), KINDS),
    "3 new alerts: 2 lost, 1 battery low.",
  );
  assert.equal(
    headline(alerts("lost"), KINDS, 4),
    "1 new alert: 1 lost. The list had no place for 4 more alerts.",
  );
});

test("a duration has one unit", () => {
  assert.deepEqual([-1, 12.4, 75, 7300].map(span), ["0 s", "12 s", "1 min", "2 h"]);
});

test("alerts of the first list are not signalled, later ones once", () => {
  const pace = new Pace();
  assert.deepEqual(pace.due([1, 2], 0), []);
  assert.deepEqual(pace.due([1, 2, 3], 100), [3]);
  assert.deepEqual(pace.due([1, 2, 3], 9000), []);
});

test("a signal comes at most once in three seconds and covers all alerts since", () => {
  const pace = new Pace();
  pace.due([], 0);
  assert.deepEqual(pace.due([1], 1000), [1]);
  assert.deepEqual(pace.due([1, 2], 2000), []);
  assert.deepEqual(pace.due([1, 2, 3], 3999), []);
  assert.deepEqual(pace.due([1, 2, 3], 4000), [2, 3]);
});

test("an alert that is acknowledged before its signal is due is not signalled", () => {
  const pace = new Pace();
  pace.due([], 0);
  pace.due([1], 1000);
  assert.deepEqual(pace.due([1, 2], 2000), []);
  assert.deepEqual(pace.due([1], 5000), []);
});
