import assert from "node:assert/strict";
import { test } from "node:test";

import { hiding, several } from "../../../src/webmap/features/view/layer_switches.js";

const LAYERS = [
  ["Scans", ".laserscan"],
  ["Maps", ".floor, .map-file"],
];

test("only layers that are switched off are hidden, and only on this map", () => {
  assert.equal(hiding(LAYERS, {}, "[a]"), "");
  assert.equal(hiding(LAYERS, { Scans: true, Other: false }, "[a]"), "");
  assert.equal(
    hiding(LAYERS, { Maps: false }, "[a]"),
    "[a] :is(.floor, .map-file) { display: none; }",
  );
});

test("one topic of a layer can be hidden alone", () => {
  const shown = { "Scans\nrear/scan": false, "Scans\nfront/scan": true };
  assert.equal(
    hiding(LAYERS, shown, "[a]"),
    '[a] :is(.laserscan)[data-layer="rear/scan"] { display: none; }',
  );
});

const drawn = (...names) => names.map((layer) => ({ dataset: layer ? { layer } : {} }));

test("a layer lists its topic names only if it has different ones", () => {
  assert.deepEqual(several(drawn("rear/scan", "front/scan", "rear/scan")), [
    "front/scan",
    "rear/scan",
  ]);
  assert.deepEqual(several(drawn("scan", "scan", "")), []);
  const many = Array.from({ length: 99 }, (_, number) => `/map_${number}`);
  assert.equal(several(drawn(...many)).length, many.length);
});

test("topic names are grouped by robot, and robot_2 comes before robot_10", () => {
  const topics = ["/robot_10/scan", "/robot_2/rear", "/robot_1/scan", "/robot_2/front"];
  assert.deepEqual(several(drawn(...topics)), [
    "/robot_1/scan",
    "/robot_2/front",
    "/robot_2/rear",
    "/robot_10/scan",
  ]);
});
