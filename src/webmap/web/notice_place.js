/**
 * @typedef {object} Box
 * @property {number} left
 * @property {number} top
 * @property {number} right
 * @property {number} bottom
 */

/** How far notices stay from what they must not cover, in pixels. */
export const GAP = 16;
/** How wide notices are at the least and at the most, in pixels. */
const LEAST = 240;
const MOST = 704;

/**
 * Where notices cover nothing that is to be pressed: as high up as they can be.
 *
 * @param {Box} area Where they may be, in pixels of the window, as everything here.
 * @param {Box[]} taken What must not be covered.
 * @param {(width: number) => number} heightOf How high they are if they are so wide.
 * @returns {{left: number, top: number, width: number} | null} null if there is no room.
 */
export function freePlace(area, taken, heightOf) {
  const near = taken.filter((box) => meets(box, area));
  const tops = [area.top, ...near.map(({ bottom }) => bottom)].map((y) => y + GAP);
  for (const top of tops.sort((a, b) => a - b)) {
    const place = placeAt(top, area, near, heightOf);
    if (place) return place;
  }
  return null;
}

/**
 * @param {number} top
 * @param {Box} area
 * @param {Box[]} taken
 * @param {(width: number) => number} heightOf
 */
function placeAt(top, area, taken, heightOf) {
  let bottom = top;
  // Beside something there is less room, and what is narrower is higher.
  for (let tries = 0; tries < 4; tries += 1) {
    const beside = taken.filter((box) => box.top < bottom + GAP && box.bottom > top - GAP);
    const [left, right] = widestSpan(area, beside);
    const width = Math.min(right - left, MOST);
    if (width < LEAST) return null;
    const needed = top + heightOf(width);
    if (needed > area.bottom - GAP) return null;
    if (needed <= bottom) return { left: (left + right - width) / 2, top, width };
    bottom = needed;
  }
  return null;
}

/**
 * @param {Box} area
 * @param {Box[]} taken
 * @returns {[number, number]} The widest part from left to right that nothing takes.
 */
function widestSpan(area, taken) {
  /** @type {[number, number]} */
  let widest = [0, 0];
  let left = area.left + GAP;
  const end = { left: area.right, right: area.right };
  for (const box of [...taken.sort((a, b) => a.left - b.left), end]) {
    const right = box.left - GAP;
    if (right - left > widest[1] - widest[0]) widest = [left, right];
    left = Math.max(left, box.right + GAP);
  }
  return widest;
}

/**
 * @param {Box} one
 * @param {Box} other
 */
export function meets(one, other) {
  const across = one.left < other.right && other.left < one.right;
  return across && one.top < other.bottom && other.top < one.bottom;
}
