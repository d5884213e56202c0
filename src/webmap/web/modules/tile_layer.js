import { html } from "./elements.js";
import { lay } from "./overlay.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('../halves.js').Half} Half */

/**
 * Say whose the tiles of a map are.
 *
 * Options: `attribution`, the words; nothing is shown without any.
 *
 * @param {MapCanvas} map
 * @param {{attribution?: string}} options
 * @returns {Half}
 */
export default function attach(map, { attribution = "" }) {
  if (!attribution) return { destroy() {} };
  const words = html("p", "webmap-panel webmap-attribution", {}, attribution);
  const take = lay(map, words, "bottom-right");
  return { destroy: take };
}
