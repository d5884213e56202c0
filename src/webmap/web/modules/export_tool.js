import { deskOf } from "../inputs/desk.js";
import { button, html, say, svg } from "./elements.js";
import { asPng, fileName, viewAsSvg } from "./export_view.js";
import { lay } from "./overlay.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('../halves.js').Half} Half */

const ICON = "M12 3.5v11M7.5 10.5l4.5 4.5 4.5-4.5M4.5 20h15";

/** Milliseconds for which the browser may still read a file that was offered to it. */
const READ_WITHIN = 60_000;

/**
 * Save what is seen of the map, as SVG or as PNG.
 *
 * Options: `place`, a selector of the page's own element for the button, and `classes`
 * that the button gets there; without a place it lies over the map.
 *
 * @param {MapCanvas} map
 * @param {{place?: string, classes?: string}} options
 * @param {(message: Record<string, unknown>) => void} send
 * @returns {Half}
 */
export default function attach(map, options, send) {
  const tool = new ExportTool(map, options, send);
  return { destroy: () => tool.destroy() };
}

class ExportTool {
  /**
   * @param {MapCanvas} map
   * @param {{place?: string, classes?: string}} options
   * @param {(message: Record<string, unknown>) => void} send
   */
  constructor(map, { place = "", classes = "" }, send) {
    this._map = map;
    this._send = send;
    const icon = svg("path", { d: ICON });
    this._go = html(
      "button",
      `webmap-export-go ${classes || "webmap-button"}`,
      { type: "button", "aria-expanded": "false", "aria-haspopup": "true" },
      svg("svg", { viewBox: "0 0 24 24", class: "icon", "aria-hidden": "true" }, icon),
    );
    this._go.setAttribute("aria-label", "Save the view as a picture");
    this._go.title = "Save the view as a picture";
    this._go.addEventListener("click", () => this._open(Boolean(this._menu.hidden)));
    this._choices = [
      button("webmap-export-svg", "SVG", () => this._save("svg")),
      button("webmap-export-png", "PNG", () => this._save("png")),
    ];
    this._menu = html(
      "div",
      "webmap-panel webmap-export-menu",
      { role: "group", "aria-label": "Save the view as" },
      ...this._choices,
    );
    this._word = html("span", "webmap-export-word", { role: "status" });
    this._element = html("div", "webmap-export", {}, this._go, this._menu, this._word);
    this._ending = new AbortController();
    const { signal } = this._ending;
    const outside = (/** @type {Event} */ event) => {
      if (event.target instanceof Node && !this._element.contains(event.target)) {
        this._open(false);
      }
    };
    addEventListener("pointerdown", outside, { signal, capture: true });
    addEventListener("focusin", outside, { signal });
    // For pages on which nobody drives, and so nobody else hears of Escape.
    const leave = (/** @type {KeyboardEvent} */ event) => {
      if (event.key === "Escape") this._leave();
    };
    this._element.addEventListener("keydown", leave, { signal });
    this._offs = [
      this._lay(place),
      deskOf(map.drive).claimEscape(() => this._leave()),
    ];
    this._open(false);
  }

  destroy() {
    this._ending.abort();
    for (const off of this._offs) off();
  }

  /**
   * @param {string} place
   * @returns {() => void}
   */
  _lay(place) {
    const own = place === "" ? null : document.querySelector(place);
    if (!own) {
      this._element.classList.add("webmap-panel");
      return lay(this._map, this._element, "top-left");
    }
    own.append(this._element);
    return () => this._element.remove();
  }

  /** @returns {boolean} Whether there was something to leave. */
  _leave() {
    if (this._menu.hidden) return false;
    this._open(false);
    this._go.focus();
    return true;
  }

  /** @param {boolean} open */
  _open(open) {
    this._menu.hidden = !open;
    this._go.setAttribute("aria-expanded", String(open));
    if (!open) return;
    const room = document.documentElement.clientWidth;
    this._element.classList.remove("leftward");
    const { right } = this._menu.getBoundingClientRect();
    this._element.classList.toggle("leftward", right > room);
    this._choices[0].focus({ preventScroll: true });
  }

  /** @param {'svg' | 'png'} kind */
  async _save(kind) {
    this._open(false);
    this._go.focus();
    const now = new Date();
    say(this._word, "Saving");
    try {
      const view = await viewAsSvg(this._map);
      const scale = Math.min(Math.max(devicePixelRatio, 1), 3);
      const file =
        kind === "svg"
          ? new Blob([view.text], { type: "image/svg+xml" })
          : await asPng(view, scale);
      offer(file, fileName(now, kind));
      say(this._word, "");
      if (view.missing.length > 0) this._send({ missing: view.missing.length });
    } catch (error) {
      say(this._word, "");
      this._send({ failed: error instanceof Error ? error.message : String(error) });
    }
  }
}

/**
 * @param {Blob} file
 * @param {string} name
 */
function offer(file, name) {
  const link = html("a", "");
  link.href = URL.createObjectURL(file);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), READ_WITHIN);
}
