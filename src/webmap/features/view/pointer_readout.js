import { html, setHidden, setText } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

/**
 * Show the pointer's position, in metres of the map.
 *
 * Options: `digits` after the decimal point.
 *
 * @param {MapCanvas} map
 * @param {{digits?: number}} options
 * @returns {BrowserPart}
 */
export default function attach(map, { digits = 2 }) {
  const output = html("output", "webmap-panel webmap-muted webmap-pointer-readout", {
    "aria-label": "Pointer position in metres",
  });
  output.hidden = true;
  const take = lay(map, output, "bottom-right");

  /** @type {{x: number, y: number} | null} */
  let pointer = null;
  const show = () => {
    setHidden(output, pointer === null);
    if (pointer === null) return;
    const { x, y } = map.toWorld(pointer.x, pointer.y);
    setText(output, `x ${metres(x, digits)}  y ${metres(y, digits)} m`);
  };

  const ending = new AbortController();
  const { signal } = ending;
  const move = (/** @type {PointerEvent} */ event) => {
    pointer = map.pointOf(event);
    show();
  };
  const leave = () => {
    pointer = null;
    show();
  };
  map.svg.addEventListener("pointermove", move, { signal });
  map.svg.addEventListener("pointerleave", leave, { signal });
  return { destroy: endOf(() => ending.abort(), map.onView(show), take) };
}

/**
 * @param {number} value
 * @param {number} digits
 */
function metres(value, digits) {
  const text = value.toFixed(digits);
  // A number that rounds to zero has no sign.
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}
