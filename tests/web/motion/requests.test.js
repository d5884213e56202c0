import assert from "node:assert/strict";
import { test } from "node:test";

import { ControlRequests } from "../../../src/webmap/web/motion/session.js";

function report(fields = {}) {
  const asker = { connection: "c9", name: "Ann", left: 8 };
  return { robot: "r1", name: "Bob", mine: true, asker, ...fields };
}

test("the time left of a request counts down from the last report", () => {
  const asking = new ControlRequests();
  asking.report(report(), 1000);
  assert.deepEqual(asking.requests(1000), [
    { robot: "r1", name: "Bob", by: "c9", who: "Ann", mine: true, left: 8 },
  ]);
  assert.equal(asking.requests(3500)[0].left, 6);
  assert.equal(asking.requests(60_000)[0].left, 0);
});

test("a request ends when the report has no asker", () => {
  for (const asker of [null, undefined]) {
    const asking = new ControlRequests();
    asking.report(report(), 0);
    asking.report(report({ asker }), 100);
    assert.deepEqual(asking.requests(100), []);
  }
});

test("an asker without a name is shown with the connection", () => {
  const asking = new ControlRequests();
  asking.report(report({ asker: { connection: "c9", name: "", left: 1 } }), 0);
  assert.equal(asking.requests(0)[0].who, "c9");
});

test("requests for a gone robot are removed", () => {
  const asking = new ControlRequests();
  asking.report(report(), 0);
  asking.gone("r1");
  assert.deepEqual(asking.requests(0), []);
});
