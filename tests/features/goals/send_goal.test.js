import assert from "node:assert/strict";
import { test } from "node:test";

import { RETRY, sendGoal, TRIES } from "../../../src/webmap/web/tools/goals.js";
import { holdTimeouts, settle } from "../../web/tools/held_timeouts.js";

const LINKLESS = "no connection to the bridge that takes goals";

const pass = holdTimeouts();

/** A gate that answers with these refusals and repeats the last one. */
function gate(...answers) {
  const asked = { times: 0 };
  asked.offer = async () => {
    const why = answers[Math.min(asked.times++, answers.length - 1)];
    if (why !== null) throw new Error(why);
  };
  return asked;
}

test("a goal without a link is sent again until the gate accepts it", async () => {
  const asked = gate(LINKLESS, LINKLESS, null);
  const sent = sendGoal(asked.offer, () => true);
  await settle();
  assert.equal(asked.times, 1, "the goal is not sent again before the wait is over");
  await pass(2);
  assert.equal(await sent, true);
  assert.equal(asked.times, 3);
});

test("a goal without a link fails with that reason after three seconds", async () => {
  const asked = gate(LINKLESS);
  const sent = assert.rejects(sendGoal(asked.offer, () => true), { message: LINKLESS });
  await pass(20);
  await sent;
  assert.equal(asked.times, TRIES);
  assert.equal((TRIES - 1) * RETRY, 3000);
});

test("a goal refused for another reason is not sent again", async () => {
  const asked = gate("Ann has control");
  const sent = assert.rejects(sendGoal(asked.offer, () => true), /Ann has control/);
  await pass(2);
  await sent;
  assert.equal(asked.times, 1);
});

test("a goal cancelled while waiting is not sent again", async () => {
  const asked = gate(LINKLESS);
  let wanted = true;
  const sent = sendGoal(asked.offer, () => wanted);
  await pass(1);
  wanted = false;
  await pass(2);
  assert.equal(await sent, false);
  assert.equal(asked.times, 2);
});
