import assert from "node:assert/strict";
import { mock, test } from "node:test";

import { importOf, partOf } from "../../src/webmap/web/browser_parts.js";

let modules = 0;

/** The URL of a module that was never requested. */
const newAddress = () => `http://localhost/_webmap/modules/${(modules += 1)}.js`;

/** A loader whose first `failures` requests fail, and the requested URLs. */
function loader(failures, error = new TypeError("Failed to fetch")) {
  const asked = [];
  const load = async (url) => {
    asked.push(url);
    if (asked.length <= failures) throw error;
    return { default: "attach" };
  };
  return { asked, load };
}

/** Wait for a promise while all timers expire. */
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

test("a module that could not be loaded is requested again with another URL", async (t) => {
  mock.timers.enable({ apis: ["setTimeout"] });
  t.after(() => mock.timers.reset());
  const { asked, load } = loader(2);
  const url = newAddress();
  assert.equal((await pass(importOf(url, load))).default, "attach");
  assert.deepEqual(asked, [url, `${url}?again=1`, `${url}?again=2`]);
  await importOf(url, load);
  assert.equal(asked.at(-1), `${url}?again=2`, "the same URL is used again");
});

test("an import fails after three failed requests", async (t) => {
  mock.timers.enable({ apis: ["setTimeout"] });
  t.after(() => mock.timers.reset());
  const { asked, load } = loader(9);
  await assert.rejects(pass(importOf(newAddress(), load)), /Failed to fetch/);
  assert.equal(asked.length, 3);
});

test("a module with a syntax error is not requested again", async () => {
  const { asked, load } = loader(9, new SyntaxError("Unexpected token"));
  await assert.rejects(importOf(newAddress(), load), SyntaxError);
  assert.equal(asked.length, 1);
});

test("parts of one bundle share its import, and come in one turn of the loop", async () => {
  const names = ["features/one.js", "features/two.js", "features/three.js"];
  const $modules = Object.fromEntries(names.map((name) => [name, { name }]));
  const asked = [];
  const load = async (url) => {
    asked.push(url);
    await new Promise((done) => setImmediate(done));
    return { $modules };
  };
  const turns = [];
  let turn = 0;
  const count = setInterval(() => (turn += 1));
  const loaded = names.map(async (name) => {
    assert.equal((await partOf(name, load)).name, name);
    turns.push(turn);
  });
  await Promise.all(loaded);
  clearInterval(count);
  assert.equal(asked.length, 1);
  assert.equal(new Set(turns).size, 1);
});

test("a bundle that failed is requested again for the next part", async () => {
  const name = "features/stop/stop_button.js";
  await assert.rejects(partOf(name, loader(9).load), /Failed to fetch/);
  const load = async () => ({ $modules: { [name]: { name } } });
  assert.equal((await partOf(name, load)).name, name);
});
