import { button, html } from "./elements.js";
import { asPng, fileName, viewAsSvg } from "./export_view.js";
import { joinSaveMenu, offer } from "./save_menu.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('../halves.js').Half} Half */
/** @typedef {import('./save_menu.js').Where} Where */

/**
 * Save what is seen of the map, as SVG or as PNG.
 *
 * Options: `place`, a selector of the page's own element for the button, and `classes`
 * that the button gets there; without a place it lies over the map.
 *
 * @param {MapCanvas} map
 * @param {Where} options
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
   * @param {Where} where
   * @param {(message: Record<string, unknown>) => void} send
   */
  constructor(map, where, send) {
    this._map = map;
    this._send = send;
    const content = html(
      "div",
      "webmap-export-choices",
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
    this._menu.say("Saving");
    try {
      const view = await viewAsSvg(this._map);
      const scale = Math.min(Math.max(devicePixelRatio, 1), 3);
      const file =
        kind === "svg"
          ? new Blob([view.text], { type: "image/svg+xml" })
          : await asPng(view, scale);
      offer(file, fileName(now, kind));
      this._menu.say("");
      if (view.missing.length > 0) this._send({ missing: view.missing.length });
    } catch (error) {
      this._menu.say("");
      this._send({ failed: error instanceof Error ? error.message : String(error) });
    }
  }
}
