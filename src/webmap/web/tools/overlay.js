import { html } from "./elements.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/** @type {WeakMap<MapCanvas, Overlay>} */
const overlays = new WeakMap();

/** @typedef {'top-left' | 'top-right' | 'bottom-left' | 'bottom-right'} Corner */

/** @type {readonly Corner[]} In the order in which keys go through them. */
const CORNERS = ["top-left", "top-right", "bottom-left", "bottom-right"];

/**
 * Put something over a map.
 *
 * @param {MapCanvas} map
 * @param {Element} panel
 * @param {Corner} [corner] Where panels share the room; without one it covers the map.
 * @param {string} [place] A selector of the page's own element, which gets it instead. A
 *     page without such an element has it over the map.
 * @returns {() => void} Takes it away.
 */
export function lay(map, panel, corner, place = "") {
  const own = ownPlace(place);
  if (own) {
    own.append(panel);
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
 * @param {string} place A selector, or "" for none.
 * @returns {Element | null} The page's own element for a part of a module.
 */
export function ownPlace(place) {
  return place === "" ? null : document.querySelector(place);
}

/**
 * @param {MapCanvas} map
 * @returns {HTMLElement | null} What lies over the map, if anything does.
 */
export function overlayOf(map) {
  return overlays.get(map)?.element ?? null;
}

/**
 * An element of HTML that covers a map, wherever the page puts the map: what is in the
 * `<svg>` cannot be laid out. Itself it lets every pointer through.
 */
class Overlay {
  /** @param {MapCanvas} map */
  constructor({ svg }) {
    this._svg = svg;
    const corners = CORNERS.map((name) => html("div", `webmap-corner ${name}`));
    this._corners = new Map(CORNERS.map((name, i) => [name, corners[i]]));
    this._frame = html("div", "webmap-frame", {}, ...corners);
    this.element = html("div", "webmap-overlay", {}, this._frame);
    // Said here, as the style sheet may come later than this is measured.
    Object.assign(this.element.style, { position: "absolute", left: "0", top: "0" });
    const host = svg.parentElement;
    if (host && getComputedStyle(host).position === "static") {
      // So that the overlay goes along, wherever that is moved.
      host.style.position = "relative";
    }
    svg.after(this.element);
    this._frame.addEventListener("toggle", ({ target }) => this._makeRoom(target), {
      capture: true,
    });
    this._observer = new ResizeObserver(() => this._place());
    this._observer.observe(svg);
    if (host) this._observer.observe(host);
    this._place();
  }

  /** Whether nothing lies over the map any more. */
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

  /**
   * Fold what a panel that was unfolded lies over, where the style has panels lie over
   * one another as there is little room.
   *
   * @param {EventTarget | null} opened
   */
  _makeRoom(opened) {
    if (!(opened instanceof HTMLDetailsElement) || !opened.open || !isLoose(opened)) return;
    for (const other of opened.parentElement?.children ?? []) {
      if (other === opened || !(other instanceof HTMLDetailsElement)) continue;
      if (other.open && isLoose(other)) other.open = false;
    }
  }

  _place() {
    const { style } = this.element;
    const map = this._svg.getBoundingClientRect();
    const now = this.element.getBoundingClientRect();
    style.left = `${Number.parseFloat(style.left) + map.left - now.left}px`;
    style.top = `${Number.parseFloat(style.top) + map.top - now.top}px`;
    style.width = `${map.width}px`;
    style.height = `${map.height}px`;
  }
}

/** @param {Element} element */
function isLoose(element) {
  return [null, "::details-content"].some((part) =>
    ["absolute", "fixed"].includes(getComputedStyle(element, part).position),
  );
}
