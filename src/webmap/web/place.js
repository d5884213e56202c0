import { initialView, rotate, scaleOf, translate, unapply } from "./view.js";

/** @typedef {import('./view.js').Matrix} Matrix */
/** @typedef {import('./layout.js').Place} Place */
/** @typedef {{width: number, height: number}} Size Pixels. */

/** How much of its size a view may be skewed by rounding. */
const ROUNDING = 1e-6;

/**
 * Say what is seen without saying on how large a screen.
 *
 * @param {Matrix} view
 * @param {Size} size
 * @returns {Place | null} null if the view is skewed or mirrored, which no hand does.
 */
export function placeOf(view, { width, height }) {
  const scale = scaleOf(view);
  const skewed = Math.max(Math.abs(view.a + view.d), Math.abs(view.b - view.c));
  if (!(skewed <= ROUNDING * scale)) return null;
  const { x, y } = unapply(view, width / 2, height / 2);
  return { x, y, pixels_per_metre: scale, turn_rad: Math.atan2(-view.b, view.a) };
}

/**
 * @param {Place} place
 * @param {Size} size
 * @returns {Matrix} The view with that place in its middle.
 */
export function viewOf({ x, y, pixels_per_metre: k, turn_rad }, { width, height }) {
  const [across, down] = [width / 2, height / 2];
  const straight = { ...initialView(width, height), a: k, d: -k };
  const there = translate(straight, -k * x, k * y);
  return rotate(there, (turn_rad * 180) / Math.PI, across, down);
}
