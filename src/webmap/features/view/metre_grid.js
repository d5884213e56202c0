import { scaleOf } from "../../web/view.js";
import { svg } from "../../web/tools/elements.js";
import { endOf } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

let grids = 0;

/**
 * Return the distance between two lines.
 *
 * @param {number} scale Pixels per metre.
 * @param {number} least The least distance, in pixels.
 * @returns {number | null} In metres, a round number from 1 on; null if the scale is
 *     not valid.
 */
function gridStep(scale, least) {
  const metres = least / scale;
  if (!(metres > 0) || !Number.isFinite(metres)) return null;
  if (metres <= 1) return 1;
  const power = 10 ** Math.floor(Math.log10(metres));
  const digit = [1, 2, 5].find((each) => each * power >= metres * (1 - 1e-9)) ?? 10;
  return digit * power;
}

/**
 * Draw a grid of lines below the map.
 *
 * Options: `least`, the least distance between two lines, in pixels.
 *
 * @param {MapCanvas} map
 * @param {{least?: number}} options
 * @returns {BrowserPart}
 */
export default function attach(map, { least = 32 }) {
  const id = `webmap-metre-grid-${++grids}`;
  const lines = svg("path", { class: "webmap-metre-grid-line" });
  const pattern = svg("pattern", { id, patternUnits: "userSpaceOnUse" }, lines);
  const ground = svg("rect", { width: "100%", height: "100%", fill: `url(#${id})` });
  const defs = svg("defs", {}, pattern);
  const element = svg("g", { class: "webmap-metre-grid", "aria-hidden": "true" }, defs, ground);
  map.svg.insertBefore(element, map.world);

  const show = () => {
    const { a, b, c, d, e, f } = map.view;
    const scale = scaleOf(map.view);
    const step = gridStep(scale, least);
    element.style.display = step === null ? "none" : "";
    if (step === null) return;
    pattern.setAttribute("width", `${step}`);
    pattern.setAttribute("height", `${step}`);
    pattern.setAttribute("patternTransform", `matrix(${a} ${b} ${c} ${d} ${e} ${f})`);
    lines.setAttribute("d", `M0 ${step}V0H${step}`);
    lines.setAttribute("stroke-width", `${2 / scale}`);
  };
  show();
  return { destroy: endOf(map.onView(show), () => element.remove()) };
}
