import { html } from "../../web/tools/elements.js";
import { lay } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

/**
 * Show the attribution of a map's tiles.
 *
 * Options: `attribution`, the text; nothing is shown without it.
 *
 * @param {MapCanvas} map
 * @param {{attribution?: string}} options
 * @returns {BrowserPart}
 */
export default function attach(map, { attribution = "" }) {
  if (!attribution) return { destroy() {} };
  const words = html("p", "webmap-panel webmap-attribution", {}, attribution);
  const take = lay(map, words, "bottom-right");
  return { destroy: take };
}
