import { FakeElement } from "../../web/tools/fake_elements.js";

import assert from "node:assert/strict";
import { test } from "node:test";

import { Halos } from "../../../src/webmap/features/drive/teleop.js";

globalThis.CSS = { escape: (text) => text };
globalThis.SVGGraphicsElement = FakeElement;
globalThis.requestAnimationFrame = () => 1;

test("halos are hidden while the connection is lost", () => {
  const moving = { robot: "r1", state: "driving", measured: [0.4, 0, 0] };
  const drive = { state: "open", robots: new Map([["r1", moving]]) };
  const world = new FakeElement();
  const halos = new Halos({ drive, world });
  halos.show();
  assert.equal(world.children.length, 1);
  drive.state = "lost";
  halos.show();
  assert.equal(world.children.length, 0);
  drive.state = "open";
  halos.show();
  assert.equal(world.children.length, 1);
});
