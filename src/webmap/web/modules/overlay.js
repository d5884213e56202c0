import { html } from "./elements.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/** @type {WeakMap<MapCanvas, Overlay>} */
const overlays = new WeakMap();

/**
 * Put a panel over a map.
 *
 * @param {MapCanvas} map
 * @param {Element} panel
 * @returns {() => void} Takes it away.
 */
export function lay(map, panel) {
  const overlay = overlays.get(map) ?? new Overlay(map);
  overlays.set(map, overlay);
  overlay.element.append(panel);
  return () => {
    panel.remove();
    if (overlay.element.childElementCount > 0) return;
    overlay.destroy();
    overlays.delete(map);
  };
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
 * `<svg>` is zoomed and cannot hold buttons. Itself it lets every pointer through.
 */
class Overlay {
  /** @param {MapCanvas} map */
  constructor({ svg }) {
    this._svg = svg;
    this.element = html("div", "webmap-overlay");
    svg.after(this.element);
    // Said here as well as in the style sheet, which may come later than this.
    this.element.style.position = "absolute";
    this._observer = new ResizeObserver(() => this._place());
    this._observer.observe(svg);
    const host = svg.parentElement;
    if (host) this._hold(host);
    this._place();
  }

  destroy() {
    this._observer.disconnect();
    this.element.remove();
  }

  /**
   * What the map was put into shall carry the overlay along, wherever it moves.
   *
   * @param {HTMLElement} host
   */
  _hold(host) {
    this._observer.observe(host);
    if (getComputedStyle(host).position === "static") host.classList.add("webmap-host");
  }

  _place() {
    const { style } = this.element;
    const map = this._svg.getBoundingClientRect();
    const now = this.element.getBoundingClientRect();
    style.left = `${this._number(style.left) + map.left - now.left}px`;
    style.top = `${this._number(style.top) + map.top - now.top}px`;
    style.width = `${map.width}px`;
    style.height = `${map.height}px`;
  }

  /** @param {string} pixels */
  _number(pixels) {
    return Number.parseFloat(pixels) || 0;
  }
}
