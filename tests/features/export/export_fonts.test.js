import assert from "node:assert/strict";
import { test } from "node:test";

import { withGenericFamily } from "../../../src/webmap/features/export/export_copy.js";

test("a font list gets a generic family at its end", () => {
  assert.equal(withGenericFamily("system-ui"), "system-ui, sans-serif");
  assert.equal(withGenericFamily('"Segoe UI", Roboto'), '"Segoe UI", Roboto, sans-serif');
  assert.equal(withGenericFamily("ui-monospace"), "ui-monospace, monospace");
  assert.equal(withGenericFamily(""), "sans-serif");
});

test("a font list with a generic family is unchanged", () => {
  for (const families of ["sans-serif", '"Times New Roman", serif', "Arial, Sans-Serif"]) {
    assert.equal(withGenericFamily(families), families);
  }
});
