import assert from "node:assert/strict";
import { test } from "node:test";

import { hiding } from "../../../src/webmap/web/modules/layer_switches.js";

const LAYERS = [
  ["Scans", ".laserscan"],
  ["Maps", ".floor, .map-file"],
];

test("only what is switched off is hidden, and only on this map", () => {
  assert.equal(hiding(LAYERS, {}, "[a]"), "");
  assert.equal(hiding(LAYERS, { Scans: true, Other: false }, "[a]"), "");
  assert.equal(
    hiding(LAYERS, { Maps: false }, "[a]"),
    "[a] :is(.floor, .map-file) { display: none; }",
  );
});
