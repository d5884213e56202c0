import assert from "node:assert/strict";
import { afterEach, beforeEach, describe, test } from "node:test";
import {
  checkSize,
  keepView,
  keptView,
  LayoutRefused,
  MOST_BYTES,
  placeOf,
  readLayout,
  viewOf,
  writeLayout,
} from "../../src/webmap/web/layout.js";
import { LayoutParts } from "../../src/webmap/web/layout_parts.js";
import {
  apply,
  initialView,
  rotate,
  scale,
  translate,
} from "../../src/webmap/web/view.js";


const VIEW = { x: 12.5, y: -3, pixels_per_metre: 40, turn_rad: 0.5 };
const LAYOUT = {
  view: VIEW,
  layers: { open: true, shown: { Costmaps: false, "Scans\n/scan": true } },
  log: { open: false, least: "warn" },
  panel: { open: true, width: 320, more: false },
  camera: { dock: "float", x: 0.25, y: 1 },
  list: { order: "state", group: "tag", rows: "compact", states: ["stopped"] },
};

/** @param {(layout: any) => void} change */
function changed(change) {
  const layout = { version: 1, ...structuredClone(LAYOUT) };
  change(layout);
  return JSON.stringify(layout);
}

/**
 * @param {string} text
 * @param {...string} fragments
 */
function assertRefused(text, ...fragments) {
  assert.throws(
    () => readLayout(text),
    (error) => {
      assert.ok(error instanceof LayoutRefused, String(error));
      for (const fragment of fragments) {
        assert.ok(error.message.includes(fragment), error.message);
      }
      return true;
    },
  );
}

describe("a layout file", () => {
  test("has the same content after writing and reading", () => {
    assert.deepEqual(readLayout(writeLayout(LAYOUT)), LAYOUT);
  });

  test("with a wrong part for the list is refused", () => {
    assertRefused(changed((layout) => (layout.list.order = "best")), "list.order", "best");
    assertRefused(changed((layout) => (layout.list.states = "stopped")), "list.states");
    assertRefused(changed((layout) => (layout.list.states = [1])), "list.states");
    assertRefused(changed((layout) => (layout.list.states = Array(31).fill(""))), "30");
  });

  test("may contain only some parts", () => {
    assert.deepEqual(readLayout('{"version": 1}'), {});
    assert.deepEqual(readLayout(writeLayout({ view: VIEW })), { view: VIEW });
  });

  test("that is not JSON is refused with the start of its text", () => {
    assertRefused("<svg>…", "expected JSON", '"<svg>…"', "Save");
    assertRefused("", "an empty file");
    assertRefused("x".repeat(1000), `"${"x".repeat(39)}…`);
  });

  test("with other JSON is refused", () => {
    assertRefused("[1]", "expected a table, got a list");
    assertRefused("null", "expected a table, got null");
    assertRefused('{"bridges": {}}', '"version": 1', "got none");
  });

  test("of another version is refused with both versions", () => {
    assertRefused('{"version": 2}', "another version", "expected 1, got 2");
    assertRefused('{"version": "1"}', 'expected 1, got "1"');
  });

  test("that is too large is refused with both sizes", () => {
    assertRefused(" ".repeat(MOST_BYTES + 1), "at most 64 kB, got 65 kB");
    assertRefused(`"${"é".repeat(MOST_BYTES / 2)}"`, "at most 64 kB");
    checkSize(MOST_BYTES);
  });

  test("with a wrong value is refused with its key, the expected and the actual value", () => {
    const wrong = /** @type {[(layout: any) => void, ...string[]][]} */ ([
      [(l) => (l.view.x = "12"), 'view.x: expected a number from', 'got "12"'],
      [(l) => (l.view.x = 1e300), "view.x", "got 1e+300"],
      [(l) => (l.view.pixels_per_metre = 0), "view.pixels_per_metre", "from 0.001", "got 0"],
      [(l) => (l.view.turn_rad = null), "view.turn_rad", "got null"],
      [(l) => delete l.view.y, "view.y", "got nothing"],
      [(l) => (l.view = []), "view: expected a table, got a list"],
      [(l) => (l.layers.open = 1), "layers.open: expected true or false, got 1"],
      [(l) => (l.layers.shown.Maps = "no"), 'layers.shown["Maps"]', 'got "no"'],
      [(l) => (l.layers.shown["a".repeat(301)] = true), "300 characters"],
      [(l) => (l.log.least = "loud"), 'log.least: expected "debug", "info"', 'got "loud"'],
      [(l) => (l.panel.width = -1), "panel.width: expected a number from 0", "got -1"],
      [(l) => (l.panel.open = "yes"), "panel.open", 'got "yes"'],
      [(l) => (l.camera.dock = "left"), 'camera.dock: expected "side"', 'got "left"'],
      [(l) => (l.camera.x = 2), "camera.x: expected a number from 0 to 1, got 2"],
    ]);
    for (const [change, ...fragments] of wrong) {
      assertRefused(changed(change), ...fragments);
    }
  });

  test("with any other key, such as a robot, is refused completely", () => {
    assertRefused(changed((l) => (l.selected = "bob")), 'has "selected"', "view, layers");
    assertRefused(changed((l) => (l.view.follow = 3)), 'view: has "follow"');
    assertRefused(changed((l) => (l.camera.open = true)), 'camera: has "open"');
    assertRefused('{"version": 1, "__proto__": {}}', '"__proto__"');
  });

  test("may contain a layer with the name of a JavaScript property", () => {
    const text = '{"version": 1, "layers": {"open": false, "shown": {"__proto__": false}}}';
    const { layers } = readLayout(text);
    assert.deepEqual(Object.entries(layers.shown), [["__proto__", false]]);
  });
});

describe("a view that is saved as a place", () => {
  const size = { width: 800, height: 600 };

  test("is restored as the same view", () => {
    const view = rotate(scale(translate(initialView(800, 600), 7, -9), 31, 5, 6), 50, 3, 4);
    const again = viewOf(placeOf(view, size), size);
    for (const key of "abcdef") assert.ok(Math.abs(again[key] - view[key]) < 1e-6, key);
  });

  test("is centred on a screen of any size", () => {
    const phone = { width: 390, height: 844 };
    const view = viewOf(VIEW, phone);
    const middle = apply(view, VIEW.x, VIEW.y);
    assert.ok(Math.hypot(middle.x - 195, middle.y - 422) < 1e-9);
    const back = placeOf(view, phone);
    for (const key of Object.keys(VIEW)) assert.ok(Math.abs(back[key] - VIEW[key]) < 1e-9, key);
  });

  test("is rotated counter-clockwise on the screen", () => {
    const view = viewOf({ x: 0, y: 0, pixels_per_metre: 1, turn_rad: Math.PI / 2 }, size);
    const east = apply(view, 10, 0);
    assert.ok(Math.hypot(east.x - 400, east.y - 290) < 1e-9);
  });

  test("is null if skewed or mirrored", () => {
    const straight = initialView(800, 600);
    assert.equal(placeOf({ ...straight, d: 1 }, size), null);
    assert.equal(placeOf({ ...straight, a: 2 }, size), null);
    assert.equal(placeOf({ ...straight, c: 0.1 }, size), null);
  });
});

describe("the parts of a layout", () => {
  test("read, write and reset only their own values", () => {
    const parts = new LayoutParts();
    const wrote = [];
    const part = (name) => ({
      read: () => LAYOUT[name],
      write: (value) => wrote.push([name, value]),
      reset: () => wrote.push([name, "found"]),
    });
    const leave = parts.add("log", part("log"));
    parts.add("layers", part("layers"));
    assert.deepEqual(parts.read(), { log: LAYOUT.log, layers: LAYOUT.layers });
    parts.write({ view: VIEW, log: LAYOUT.log, camera: LAYOUT.camera });
    leave();
    parts.write(LAYOUT);
    parts.reset();
    const { log, layers } = LAYOUT;
    assert.deepEqual(wrote, [["log", log], ["layers", layers], ["layers", "found"]]);
  });
});

describe("the last views", () => {
  /** @type {string | null} */
  let text = null;
  beforeEach(() => {
    text = null;
    globalThis.localStorage = {
      getItem: () => text,
      setItem: (_key, value) => (text = value),
    };
  });
  afterEach(() => {
    delete globalThis.localStorage;
  });

  test("are kept for each URL path until they are removed", () => {
    keepView("/", VIEW);
    keepView("/hall", { ...VIEW, x: 1 });
    assert.deepEqual(keptView("/"), VIEW);
    assert.equal(keptView("/hall").x, 1);
    keepView("/", null);
    assert.equal(keptView("/"), null);
    assert.equal(keptView("toString"), null);
  });

  test("are at most 32, and the oldest one is removed first", () => {
    for (let i = 0; i < 32; i++) keepView(`/${i}`, VIEW);
    keepView("/0", VIEW);
    keepView("/32", VIEW);
    assert.equal(keptView("/1"), null);
    assert.deepEqual(keptView("/0"), VIEW);
    assert.equal(Object.keys(JSON.parse(text)).length, 32);
  });

  test("are null with invalid data in the storage or without a storage", () => {
    for (const other of ["{", "[]", "7", '{"/": 3}', '{"/": {"x": 1}}']) {
      text = other;
      assert.equal(keptView("/"), null, other);
    }
    delete globalThis.localStorage;
    keepView("/", VIEW);
    assert.equal(keptView("/"), null);
  });
});
