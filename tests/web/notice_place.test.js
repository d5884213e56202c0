import assert from "node:assert/strict";
import { test } from "node:test";

import { GAP, freePlace, meets } from "../../src/webmap/web/notices.js";

/**
 * @param {number} left
 * @param {number} top
 * @param {number} right
 * @param {number} bottom
 */
const box = (left, top, right, bottom) => ({ left, top, right, bottom });

/** @param {number} width Of notices with a text of 700 by 60 pixels. */
const textHeight = (width) => Math.ceil(700 / width) * 60;

const DESKTOP = box(328, 72, 1280, 800);
const PHONE = box(0, 52, 390, 726);

/** @param {import("../../src/webmap/web/notices.js").Box[]} boxes */
function covered(area, boxes) {
  const place = freePlace(area, boxes, textHeight);
  if (!place) return null;
  const { left, top, width } = place;
  const notices = box(left, top, left + width, top + textHeight(width));
  assert.ok(left >= area.left && left + width <= area.right);
  assert.ok(top >= area.top && notices.bottom <= area.bottom);
  return { ...place, count: boxes.filter((one) => meets(one, notices)).length };
}

test("notices on an empty map are at the top, in the centre", () => {
  const place = freePlace(DESKTOP, [], () => 40);
  assert.deepEqual(place, { left: 452, top: 72 + GAP, width: 704 });
});

test("notices lie below a row of buttons, beside a column and beside a card", () => {
  const row = [396, 477, 572, 648, 722, 836].map((x) => box(x, 84, x + 70, 130));
  const column = [84, 128, 172, 216].map((y) => box(340, y, 384, y + 44));
  const card = [175, 227, 279].map((y) => box(964, y, 1252, y + 44));
  const place = covered(DESKTOP, [...row, ...column, ...card]);
  assert.equal(place?.count, 0);
  assert.equal(place?.top, 130 + GAP);
  assert.equal(place?.width, 964 - 384 - 2 * GAP);
});

test("notices on a phone lie below two rows, beside the buttons of the view", () => {
  const rows = [64, 118].flatMap((y) => [12, 93, 189].map((x) => box(x, y, x + 66, y + 46)));
  const column = [box(334, 64, 378, 240)];
  const place = covered(PHONE, [...rows, ...column]);
  assert.equal(place?.count, 0);
  assert.equal(place?.top, 164 + GAP);
});

test("elements beside the map take no room from notices", () => {
  const list = [100, 300, 500].map((y) => box(0, y, 327, y + 190));
  assert.equal(covered(DESKTOP, list)?.top, 72 + GAP);
});

test("notices never cover buttons at random places", () => {
  let seed = 1;
  const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  let placed = 0;
  for (let round = 0; round < 300; round += 1) {
    const boxes = Array.from({ length: 8 }, () => {
      const [x, y] = [328 + 900 * random(), 72 + 680 * random()];
      return box(x, y, x + 90, y + 44);
    });
    const place = covered(DESKTOP, boxes);
    if (place) placed += 1;
    assert.equal(place?.count ?? 0, 0);
  }
  assert.ok(placed > 250, `${placed} of 300`);
});

test("there is no place for notices without room", () => {
  assert.equal(freePlace(PHONE, [box(0, 0, 390, 844)], textHeight), null);
});
