import assert from "node:assert/strict";
import { test } from "node:test";

import { standingAlone } from "../../../src/webmap/features/export/export_copy.js";

test("a list of fonts ends with a kind that every program knows", () => {
  assert.equal(standingAlone("system-ui"), "system-ui, sans-serif");
  assert.equal(standingAlone('"Segoe UI", Roboto'), '"Segoe UI", Roboto, sans-serif');
  assert.equal(standingAlone("ui-monospace"), "ui-monospace, monospace");
  assert.equal(standingAlone(""), "sans-serif");
});

test("what names such a kind stays as it is, so that this machine draws as before", () => {
  for (const families of ["sans-serif", '"Times New Roman", serif', "Arial, Sans-Serif"]) {
    assert.equal(standingAlone(families), families);
  }
});
