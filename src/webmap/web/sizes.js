import { LONGEST_TEXTS } from "./constants.js";

/** Characters for sizes in the socket's address; servers take some 8000 in all. */
const SIZES_ROOM = 3000;

/**
 * @param {Element} element
 * @returns {{width: number, height: number}} Pixels within border and padding.
 */
export function contentSize(element) {
  const style = getComputedStyle(element);
  /** @param {string[]} names */
  const sum = (...names) =>
    names.reduce((all, name) => all + Number.parseFloat(style.getPropertyValue(name)), 0);
  const { width, height } = element.getBoundingClientRect();
  const across = sum("border-left-width", "border-right-width", "padding-left", "padding-right");
  const down = sum("border-top-width", "border-bottom-width", "padding-top", "padding-bottom");
  return { width: Math.max(0, width - across), height: Math.max(0, height - down) };
}

/** @returns {Record<string, [number, number]>} The sizes of the page's own elements. */
export function containers() {
  /** @type {Record<string, [number, number]>} */
  const sizes = {};
  let room = SIZES_ROOM;
  for (const element of document.body.querySelectorAll("[id]:not(svg *)")) {
    // The styles of parts that are not shown take most of the time.
    if (element.getClientRects().length === 0) continue;
    const { id } = element;
    const [width, height] = Object.values(contentSize(element)).map(Math.round);
    if (id.length > LONGEST_TEXTS.name || (width === 0 && height === 0)) continue;
    room -= encodeURIComponent(JSON.stringify([id, width, height])).length;
    if (room < 0) break;
    sizes[id] = [width, height];
  }
  return sizes;
}
