import assert from "node:assert/strict";
import { mock, test } from "node:test";

import { importOf } from "../../src/webmap/web/imports.js";

const URL_OF_STOP = "http://localhost/_webmap/modules/stop.js";

/** What is asked for, where the first so many requests end in an error. */
function loader(failures, error = new TypeError("Failed to fetch")) {
  const asked = [];
  const load = async (url) => {
    asked.push(url);
    if (asked.length <= failures) throw error;
    return { default: "attach" };
  };
  return { asked, load };
}

/** Let all that is waited for come. */
async function pass(promise) {
  let over = false;
  const ended = promise.finally(() => (over = true)).catch(() => {});
  while (!over) {
    mock.timers.tick(1000);
    await new Promise((done) => setImmediate(done));
  }
  await ended;
  return promise;
}

test("a module that could not be had is asked for again, by another address", async (t) => {
  mock.timers.enable({ apis: ["setTimeout"] });
  t.after(() => mock.timers.reset());
  const { asked, load } = loader(2);
  assert.equal((await pass(importOf(URL_OF_STOP, load))).default, "attach");
  assert.deepEqual(asked, [URL_OF_STOP, `${URL_OF_STOP}?again=1`, `${URL_OF_STOP}?again=2`]);
});

test("what cannot be had for good is said in the end", async (t) => {
  mock.timers.enable({ apis: ["setTimeout"] });
  t.after(() => mock.timers.reset());
  const { asked, load } = loader(9);
  await assert.rejects(pass(importOf(URL_OF_STOP, load)), /Failed to fetch/);
  assert.equal(asked.length, 3);
});

test("a module that is wrong is not asked for again", async () => {
  const { asked, load } = loader(9, new SyntaxError("Unexpected token"));
  await assert.rejects(importOf(URL_OF_STOP, load), SyntaxError);
  assert.equal(asked.length, 1);
});
