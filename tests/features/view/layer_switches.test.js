import assert from "node:assert/strict";
import { test } from "node:test";

import { drawingNames, hidingRules } from "../../../src/webmap/features/view/layer_switches.js";

const LAYERS = [
  ["Scans", ".laserscan"],
  ["Maps", ".floor, .map-file"],
];

test("only layers that are switched off are hidden, and only on this map", () => {
  assert.equal(hidingRules(LAYERS, {}, "[a]"), "");
  assert.equal(hidingRules(LAYERS, { Scans: true, Other: false }, "[a]"), "");
  assert.equal(
    hidingRules(LAYERS, { Maps: false }, "[a]"),
    "[a] :is(.floor, .map-file) { display: none; }",
  );
});

test("one topic of a layer can be hidden alone", () => {
  const shown = { "Scans\nrear/scan": false, "Scans\nfront/scan": true };
  assert.equal(
    hidingRules(LAYERS, shown, "[a]"),
    '[a] :is(.laserscan)[data-layer="rear/scan"] { display: none; }',
  );
});

const drawn = (...names) => names.map((layer) => ({ dataset: layer ? { layer } : {} }));

test("a layer lists its topic names only if it has different ones", () => {
  assert.deepEqual(drawingNames(drawn("rear/scan", "front/scan", "rear/scan")), [
    "front/scan",
    "rear/scan",
  ]);
  assert.deepEqual(drawingNames(drawn("scan", "scan", "")), []);
  const many = Array.from({ length: 99 }, (_, number) => `/map_${number}`);
  assert.equal(drawingNames(drawn(...many)).length, many.length);
});

test("topic names are grouped by robot, and robot_2 comes before robot_10", () => {
  const topics = ["/robot_10/scan", "/robot_2/rear", "/robot_1/scan", "/robot_2/front"];
  assert.deepEqual(drawingNames(drawn(...topics)), [
    "/robot_1/scan",
    "/robot_2/front",
    "/robot_2/rear",
    "/robot_10/scan",
  ]);
});
