import { html, keepOrder } from "./elements.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/** @type {WeakMap<MapCanvas, Overlay>} */
const overlays = new WeakMap();

/** @typedef {'top-left' | 'top-right' | 'bottom-left' | 'bottom-right'} Corner */

/** @type {readonly Corner[]} In the order of the Tab key. */
const CORNERS = ["top-left", "top-right", "bottom-left", "bottom-right"];

/**
 * Put an element over a map, or beside it: a page that has its own element with
 * `data-webmap-corner="top-left"` gets there what would be in that corner of the map.
 *
 * @param {MapCanvas} map
 * @param {Element} panel
 * @param {Corner} [corner] The corner for it; without one it covers the map.
 * @param {string} [place] A selector of the page's own element, which contains it
 *     instead. If the page has no such element, it is in its corner.
 * @returns {() => void} Removes it.
 */
export function lay(map, panel, corner, place = "") {
  const own = ownPlace(place) ?? (corner ? ownCorner(corner) : null);
  if (own) {
    own.append(panel);
    sortSoon(own);
    return () => panel.remove();
  }
  const overlay = overlays.get(map) ?? new Overlay(map);
  overlays.set(map, overlay);
  overlay.add(panel, corner);
  return () => {
    panel.remove();
    if (!overlay.empty) return;
    overlay.destroy();
    overlays.delete(map);
  };
}

/**
 * Make the function that ends several things, such as the elements of {@link lay}.
 *
 * @param {...((() => unknown) | {destroy: () => void})} parts
 * @returns {() => void} Ends them, in this order.
 */
export function endOf(...parts) {
  return () => {
    for (const part of parts) {
      if (typeof part === "function") part();
      else part.destroy();
    }
  };
}

/** @type {Set<Element>} The page's own elements with panels that are not in order yet. */
const unsorted = new Set();

/**
 * Sort panels before the browser paints them.
 *
 * @param {Element} own
 */
function sortSoon(own) {
  if (unsorted.size === 0) requestAnimationFrame(sortAll);
  unsorted.add(own);
}

function sortAll() {
  for (const own of unsorted) {
    const panels = [...own.children].map((panel) => ({ panel, place: placeOf(panel, own) }));
    panels.sort((one, other) => one.place - other.place);
    keepOrder(own, panels.map(({ panel }) => panel));
  }
  unsorted.clear();
}

/**
 * @param {Element} panel
 * @param {Element} own
 * @returns {number} Its place in the page's own element, which has the classes of its
 *     panels in `data-webmap-order`; others are last. The Tab key goes in this order.
 */
function placeOf(panel, own) {
  const order = own.getAttribute("data-webmap-order")?.split(" ") ?? [];
  const place = order.findIndex((name) => panel.classList.contains(`webmap-${name}`));
  return place < 0 ? order.length : place;
}

/**
 * @param {string} place A selector, or "" for none.
 * @returns {Element | null} The page's own element for a part of a module.
 */
export function ownPlace(place) {
  return place === "" ? null : document.querySelector(place);
}

/**
 * @param {Corner} corner
 * @returns {Element | null} The page's own element for a corner of its map.
 */
function ownCorner(corner) {
  const own = document.querySelector(`[data-webmap-corner="${corner}"]`);
  if (own instanceof HTMLElement && !own.dataset.webmapListens) {
    own.dataset.webmapListens = "";
    own.addEventListener("toggle", makeRoom, { capture: true });
  }
  return own;
}

/**
 * @param {MapCanvas} map
 * @returns {HTMLElement | null} The overlay of the map, if there is one.
 */
export function overlayOf(map) {
  return overlays.get(map)?.element ?? null;
}

/** @returns {Element[]} The page's own elements for corners of its map. */
export function ownCorners() {
  return [...document.querySelectorAll("[data-webmap-corner]")];
}

/**
 * An HTML element that covers a map, at every position of the map: an `<svg>` has no
 * layout for its content. It lets all pointer events through.
 */
class Overlay {
  /** @param {MapCanvas} map */
  constructor({ svg }) {
    this._svg = svg;
    const corners = CORNERS.map((name) => html("div", `webmap-corner ${name}`));
    this._corners = new Map(CORNERS.map((name, i) => [name, corners[i]]));
    this._frame = html("div", "webmap-frame", {}, ...corners);
    this.element = html("div", "webmap-overlay", {}, this._frame);
    // Set here, because the style sheet may be loaded after the first measurement.
    Object.assign(this.element.style, { position: "absolute", left: "0", top: "0" });
    const host = svg.parentElement;
    svg.after(this.element);
    this._frame.addEventListener("toggle", makeRoom, { capture: true });
    // It is called before the next paint, too.
    this._observer = new ResizeObserver(() => this._place());
    this._observer.observe(svg);
    if (host) this._observer.observe(host);
  }

  /** Whether nothing is over the map any more. */
  get empty() {
    return (
      this.element.childElementCount === 1 &&
      [...this._corners.values()].every((corner) => corner.childElementCount === 0)
    );
  }

  /**
   * @param {Element} panel
   * @param {Corner} [corner]
   */
  add(panel, corner) {
    const place = corner === undefined ? undefined : this._corners.get(corner);
    if (place) place.append(panel);
    else this._frame.before(panel);
  }

  destroy() {
    this._observer.disconnect();
    this.element.remove();
  }

  _place() {
    const { style } = this.element;
    const host = this._svg.parentElement;
    if (host && getComputedStyle(host).position === "static") {
      // So that the overlay moves with the host.
      host.style.position = "relative";
    }
    const map = this._svg.getBoundingClientRect();
    const now = this.element.getBoundingClientRect();
    style.left = `${Number.parseFloat(style.left) + map.left - now.left}px`;
    style.top = `${Number.parseFloat(style.top) + map.top - now.top}px`;
    style.width = `${map.width}px`;
    style.height = `${map.height}px`;
  }
}

/**
 * Close the other panels when one is opened, if the style puts panels over one another
 * for lack of space.
 *
 * @param {Event} event
 */
function makeRoom({ target: opened }) {
  if (!(opened instanceof HTMLDetailsElement) || !opened.open) return;
  const others = [...(opened.parentElement?.children ?? [])].filter(
    (other) => other instanceof HTMLDetailsElement && other !== opened && other.open,
  );
  // Without an open one, no styles are read: the browser would have to compute them.
  if (others.length === 0 || !isLoose(opened)) return;
  for (const other of others) if (isLoose(other)) other.removeAttribute("open");
}

/** @param {Element} details */
function isLoose(details) {
  return [details, ...details.children].some((element) =>
    ["absolute", "fixed"].includes(getComputedStyle(element).position),
  );
}
