import { button, html } from "../../web/tools/elements.js";
import { joinSaveMenu, offer } from "../../web/tools/save_menu.js";

/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/tools/save_menu.js').Where} Where */

/**
 * Save the visible map, as SVG or as PNG.
 *
 * Options: `place`, a selector of the page's own element for the button, and `classes`
 * of the button there; without `place` the button is over the map.
 *
 * @param {MapCanvas} map
 * @param {Where} options
 * @param {(message: Record<string, unknown>) => void} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new ExportTool(map, options, send);
}

class ExportTool {
  /**
   * @param {MapCanvas} map
   * @param {Where} where
   * @param {(message: Record<string, unknown>) => void} send
   */
  constructor(map, where, send) {
    this._map = map;
    this._send = send;
    const content = html(
      "div",
      "webmap-row webmap-export-choices",
      { role: "group", "aria-label": "Save the view as" },
      button("webmap-export-svg", "SVG", () => this._save("svg")),
      button("webmap-export-png", "PNG", () => this._save("png")),
    );
    const title = "Save the view as a picture";
    const group = { order: 1, title, heading: "Picture", content };
    const { menu, leave } = joinSaveMenu(map, where, group);
    this._menu = menu;
    this.destroy = leave;
  }

  /** @param {'svg' | 'png'} kind */
  async _save(kind) {
    this._menu.close();
    const now = new Date();
    this._menu.showMessage("Saving");
    try {
      const { asPng, viewAsSvg } = await import("./export_picture.js");
      const view = await viewAsSvg(this._map);
      const scale = Math.min(Math.max(devicePixelRatio, 1), 3);
      const file =
        kind === "svg"
          ? new Blob([view.text], { type: "image/svg+xml" })
          : await asPng(view, scale);
      offer(file, fileName(now, kind));
      this._menu.showMessage("");
      if (view.missing.length > 0) this._send({ missing: view.missing.length });
    } catch (error) {
      this._menu.showMessage("");
      this._send({ failed: error instanceof Error ? error.message : String(error) });
    }
  }
}

/**
 * @param {Date} now
 * @param {string} ending
 * @returns {string} A name that sorts by time and is valid on every system.
 */
function fileName(now, ending) {
  const two = (/** @type {number} */ n) => String(n).padStart(2, "0");
  const day = [now.getFullYear(), two(now.getMonth() + 1), two(now.getDate())].join("-");
  const time = [now.getHours(), now.getMinutes(), now.getSeconds()].map(two).join("");
  return `webmap-${day}-${time}.${ending}`;
}
