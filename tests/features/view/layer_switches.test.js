import assert from "node:assert/strict";
import { test } from "node:test";

import { hidingRules, switchesOf } from "../../../src/webmap/features/view/layer_switches.js";

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

test("the layers of other robots are hidden, their health is not", () => {
  const layers = [...LAYERS, ["Health", ".diagnostics"]];
  assert.equal(
    hidingRules(layers, { "Selected robot": true }, "[a]", "r1").replaceAll(
      ".laserscan,.floor, .map-file",
      "ALL",
    ),
    '[a] .robot:not(.selected) :is(ALL) { display: none; }\n' +
      '[a] :is(ALL)[data-layer-of]:not([data-layer-of="r1"]) { display: none; }',
  );
});

const drawn = (...found) => found.map(([topic, robot = ""]) => ({ topic, robot }));

test("a layer has switches for its topics only if it has different ones", () => {
  const two = drawn(["rear/scan"], ["front/scan"], ["rear/scan"]);
  assert.deepEqual(switchesOf(two), { common: ["front/scan", "rear/scan"], own: [] });
  assert.deepEqual(switchesOf(drawn(["scan"], ["scan"], [""])), { common: [], own: [] });
  const alone = drawn(["/front", "Ann"], ["/rear", "Ann"]);
  assert.deepEqual(switchesOf(alone).common, ["/front", "/rear"]);
});

test("a topic of several robots is common, one of a single robot is its own", () => {
  const found = drawn(["/r_10/scan", "Bob"], ["/r_2/scan", "Ann"], ["/map"]);
  found.push(...drawn(["costmap", "Ann"], ["costmap", "Bob"]));
  assert.deepEqual(switchesOf(found), {
    common: ["/map", "costmap"],
    own: [
      { topic: "/r_2/scan", robot: "Ann" },
      { topic: "/r_10/scan", robot: "Bob" },
    ],
  });
});
