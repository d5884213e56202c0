import { scaleOf } from "../../web/view.js";
import { html, setHidden, svg } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

/**
 * Return the longest round length that fits.
 *
 * @param {number} scale Pixels per metre.
 * @param {number} room In pixels.
 * @returns {number | null} In metres; null if the scale is not valid.
 */
export function roundLength(scale, room) {
  const most = room / scale;
  if (!(most > 0) || !Number.isFinite(most)) return null;
  const power = 10 ** Math.floor(Math.log10(most));
  const step = [5, 2].find((digit) => digit * power <= most) ?? 1;
  return step * power;
}

/**
 * @param {number} metres
 * @returns {string} With a unit that needs few digits.
 */
export function lengthText(metres) {
  if (metres >= 1000) return `${tidy(metres / 1000)} km`;
  if (metres >= 1) return `${tidy(metres)} m`;
  return metres >= 0.01 ? `${tidy(metres * 100)} cm` : `${tidy(metres * 1000)} mm`;
}

/**
 * Show a length on the map.
 *
 * Options: `width`, the greatest width of the bar, in pixels.
 *
 * @param {MapCanvas} map
 * @param {{width?: number}} options
 * @returns {BrowserPart}
 */
export default function attach(map, { width = 120 }) {
  const line = svg("path", { class: "webmap-scale-bar-line" });
  const text = html("span", "webmap-scale-bar-text");
  const drawing = svg(
    "svg",
    { width: `${width + 2}`, height: "8", "aria-hidden": "true" },
    line,
  );
  const element = html("div", "webmap-panel webmap-row webmap-scale-bar", {}, text, drawing);
  const take = lay(map, element, "bottom-right");

  let shown = NaN;
  const show = () => {
    const scale = scaleOf(map.view);
    if (scale === shown) return;
    shown = scale;
    const length = roundLength(scale, width);
    setHidden(element, length === null);
    if (length === null) return;
    const end = width + 1;
    line.setAttribute("d", `M${end - length * scale} 1v6H${end}v-6`);
    text.textContent = lengthText(length);
  };
  show();
  return { destroy: endOf(map.onView(show), take) };
}

/** @param {number} value */
function tidy(value) {
  return Number(value.toPrecision(6)).toString();
}
