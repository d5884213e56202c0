import assert from "node:assert/strict";
import { test } from "node:test";

import { standingAlone } from "../../../src/webmap/features/export/export_copy.js";

test("a font list gets a generic family at its end", () => {
  assert.equal(standingAlone("system-ui"), "system-ui, sans-serif");
  assert.equal(standingAlone('"Segoe UI", Roboto'), '"Segoe UI", Roboto, sans-serif');
  assert.equal(standingAlone("ui-monospace"), "ui-monospace, monospace");
  assert.equal(standingAlone(""), "sans-serif");
});

test("a font list with a generic family is unchanged", () => {
  for (const families of ["sans-serif", '"Times New Roman", serif', "Arial, Sans-Serif"]) {
    assert.equal(standingAlone(families), families);
  }
});
