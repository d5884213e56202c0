/**
 * What carries world coordinates (metres, y up) to a map's pixels (y down): a point
 * (x, y) goes to (a x + c y + e, b x + d y + f). Never changed, only replaced.
 *
 * @typedef {object} Matrix
 * @property {number} a
 * @property {number} b
 * @property {number} c
 * @property {number} d
 * @property {number} e
 * @property {number} f
 */

/** @typedef {{x: number, y: number}} Point */

/** The least and the most pixels that a metre may have. */
export const SMALLEST = 1e-3;
export const LARGEST = 1e6;

/**
 * @param {number} width Pixels across.
 * @param {number} height Pixels down.
 * @returns {Matrix} The world's origin in the middle, a pixel to the metre.
 */
export function initialView(width, height) {
  return { a: 1, b: 0, c: 0, d: -1, e: width / 2, f: height / 2 };
}

/**
 * @param {Matrix} m
 * @param {Matrix} n
 * @returns {Matrix} First `n`, then `m`.
 */
export function multiply(m, n) {
  return {
    a: m.a * n.a + m.c * n.b,
    b: m.b * n.a + m.d * n.b,
    c: m.a * n.c + m.c * n.d,
    d: m.b * n.c + m.d * n.d,
    e: m.a * n.e + m.c * n.f + m.e,
    f: m.b * n.e + m.d * n.f + m.f,
  };
}

/**
 * @param {Matrix} m
 * @param {number} x
 * @param {number} y
 * @returns {Point}
 */
export function apply(m, x, y) {
  return { x: m.a * x + m.c * y + m.e, y: m.b * x + m.d * y + m.f };
}

/**
 * @param {Matrix} m
 * @param {number} x
 * @param {number} y
 * @returns {Point} What `m` takes to (x, y).
 */
export function unapply(m, x, y) {
  const det = m.a * m.d - m.b * m.c;
  const [dx, dy] = [x - m.e, y - m.f];
  return { x: (m.d * dx - m.c * dy) / det, y: (m.a * dy - m.b * dx) / det };
}

/**
 * @param {Matrix} view
 * @returns {number} Pixels in a metre.
 */
export function scaleOf(view) {
  return Math.sqrt(Math.abs(view.a * view.d - view.b * view.c));
}

/**
 * @param {Matrix} view
 * @returns {boolean} Whether a map can be shown that way.
 */
export function isView(view) {
  const pixels = scaleOf(view);
  return (
    [view.a, view.b, view.c, view.d, view.e, view.f].every(Number.isFinite) &&
    pixels >= SMALLEST * 0.999 &&
    pixels <= LARGEST * 1.001
  );
}

/**
 * @param {Matrix} view
 * @param {number} x Pixels to the right.
 * @param {number} y Pixels down.
 * @returns {Matrix}
 */
export function translate(view, x, y) {
  return { ...view, e: view.e + x, f: view.f + y };
}

/**
 * Zoom about a point that stays where it is, within the limits.
 *
 * @param {Matrix} view
 * @param {number} factor Above 1 zooms in.
 * @param {number} x Pixels from the left.
 * @param {number} y Pixels from the top.
 * @returns {Matrix}
 */
export function scale(view, factor, x, y) {
  const now = scaleOf(view);
  const k = Math.min(Math.max(factor, SMALLEST / now), LARGEST / now);
  return multiply({ a: k, b: 0, c: 0, d: k, e: x - k * x, f: y - k * y }, view);
}

/**
 * Turn about a point that stays where it is.
 *
 * @param {Matrix} view
 * @param {number} degrees Counter-clockwise, as it is seen.
 * @param {number} x Pixels from the left.
 * @param {number} y Pixels from the top.
 * @returns {Matrix}
 */
export function rotate(view, degrees, x, y) {
  // Screen y points down, so that the mathematical sense would look clockwise.
  const angle = (-degrees * Math.PI) / 180;
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const [e, f] = [x - cos * x + sin * y, y - sin * x - cos * y];
  return multiply({ a: cos, b: sin, c: -sin, d: cos, e, f }, view);
}

/**
 * Show a rectangle of the world as large as it can be, turned as it is.
 *
 * @param {Matrix} view
 * @param {[number, number, number, number]} bounds x and y of two corners, in metres.
 * @param {number} width Pixels across.
 * @param {number} height Pixels down.
 * @param {number} [margin] Pixels left free on each side.
 * @returns {Matrix}
 */
export function fit(view, [x0, y0, x1, y1], width, height, margin = 24) {
  const now = scaleOf(view);
  const corners = [apply(view, x0, y0), apply(view, x1, y0), apply(view, x0, y1)];
  corners.push(apply(view, x1, y1));
  const xs = corners.map((corner) => corner.x);
  const ys = corners.map((corner) => corner.y);
  // A point, or a line, is shown with some metres around it.
  const across = Math.max(Math.max(...xs) - Math.min(...xs), now);
  const down = Math.max(Math.max(...ys) - Math.min(...ys), now);
  const free = Math.min(margin, width / 4, height / 4);
  const factor = Math.min((width - 2 * free) / across, (height - 2 * free) / down);
  const middle = apply(view, (x0 + x1) / 2, (y0 + y1) / 2);
  const centred = translate(view, width / 2 - middle.x, height / 2 - middle.y);
  return scale(centred, factor, width / 2, height / 2);
}

/**
 * The map's size changed: what was in the middle stays in the middle.
 *
 * @param {Matrix} view
 * @param {{width: number, height: number}} before
 * @param {{width: number, height: number}} after
 * @returns {Matrix}
 */
export function resize(view, before, after) {
  const [x, y] = [after.width - before.width, after.height - before.height];
  return translate(view, x / 2, y / 2);
}

/**
 * @param {Matrix} m
 * @param {Matrix} n
 * @returns {boolean} Whether `m` and `n` differ by a translation at the most.
 */
export function isShifted(m, n) {
  return m.a === n.a && m.b === n.b && m.c === n.c && m.d === n.d;
}

/**
 * @param {Matrix} m
 * @param {Matrix} n
 * @returns {boolean}
 */
export function isSame(m, n) {
  return isShifted(m, n) && m.e === n.e && m.f === n.f;
}
