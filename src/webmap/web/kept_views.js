import { asPlace } from "./layout.js";

/** @typedef {import('./layout.js').Place} Place */

/** Where the last views are kept in this browser. */
const KEPT = "webmap.views";

/** Addresses whose view is kept, at the most; the one that was seen longest ago goes. */
const MOST = 32;

/**
 * @param {string} address
 * @returns {Place | null} How that page was seen last; null if that is not known.
 */
export function keptView(address) {
  const views = all();
  return Object.hasOwn(views, address) ? asPlace(views[address]) : null;
}

/**
 * @param {string} address
 * @param {Place | null} place null to forget it.
 */
export function keepView(address, place) {
  const entries = Object.entries(all()).filter(([other]) => other !== address);
  if (place) entries.push([address, place]);
  try {
    localStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(entries.slice(-MOST))));
  } catch {
    // Without storage the page begins as it was found.
  }
}

/** @returns {Record<string, unknown>} */
function all() {
  try {
    const value = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    return typeof value === "object" && value !== null && !Array.isArray(value) ? value : {};
  } catch {
    return {}; // storage may be forbidden, or hold what is not ours
  }
}
