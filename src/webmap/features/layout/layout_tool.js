import {
  asPlace,
  checkSize,
  keepView,
  keptView,
  LayoutRefused,
  placeOf,
  readLayout,
  viewOf,
  writeLayout,
} from "../../web/layout.js";
import { button, html, setText } from "../../web/tools/elements.js";
import { endOf } from "../../web/tools/overlay.js";
import { joinSaveMenu, offer } from "../../web/tools/save_menu.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/layout.js').Place} Place */
/** @typedef {import('../../web/tools/save_menu.js').Where} Where */
/** @typedef {Where & {of?: string, restore?: boolean}} Options */
/** @typedef {(message: Record<string, unknown>) => void} Send */

const FILE = "webmap-layout.json";

/** @type {Place} */
const ORIGIN = { x: 0, y: 0, pixels_per_metre: 1, turn_rad: 0 };

/** Milliseconds after which a changed view is stored, at the latest. */
const KEEP_WITHIN = 500;

/**
 * The page's layout: save to a file, load, reset; and the last view of this address,
 * which the page restores when it opens.
 *
 * Options: `place` and `classes`, as for the export tool, with which it shares a
 * button; `of`, what the page shows, so that a view is stored for it alone; `restore`,
 * whether the page opens with the last view; `?layout=found` in its address prevents
 * this.
 *
 * Sends `{own: true}` when it has restored the last view, and receives it back after
 * all messages about the view that the display sent before. Sends `{found: true}` to
 * request the initial view.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  const views = new LastView(map, options, send);
  const tool = new LayoutTool(map, options, views, send);
  return {
    receive: () => views.restoreAgain(),
    destroy: endOf(tool, views),
  };
}

/** Stores the view that the user chose for this address, and restores it. */
class LastView {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, { of = "", restore = true }, send) {
    this._map = map;
    this._address = `${location.pathname}${location.search}#${map.element?.id ?? ""} ${of}`;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this._timer = undefined;
    const asked = new URLSearchParams(location.search).get("layout");
    this._place = keptView(this._address);
    // After a reload or a lost connection, the page itself knows the view.
    if (map.restored) map.byHand ||= this._place !== null;
    else if (this._place && restore && asked !== "found") {
      this._show(this._place);
      map.byHand = false;
      send({ own: true });
    }
    this._off = map.onView(() => {
      this._timer ??= setTimeout(() => this._keep(), KEEP_WITHIN);
    });
    this._ending = new AbortController();
    const { signal } = this._ending;
    addEventListener("pagehide", () => this._keep(), { signal });
  }

  destroy() {
    this._ending.abort();
    this._off();
    this._keep();
  }

  /**
   * Restore the view again after earlier messages of the display, unless the user has
   * moved the view.
   */
  restoreAgain() {
    if (this._map.byHand || !this._place) return;
    this._show(this._place);
    // The user chose this view in an earlier session.
    this._map.byHand = true;
  }

  /** @param {Place} place */
  _show(place) {
    this._map.follow(0);
    this._map.setView(viewOf(place, this._map));
  }

  /**
   * Store nothing until the user moves the view again. The rotation is reset, as on a
   * new page; the display sends the scale and the position.
   */
  forget() {
    const seen = placeOf(this._map.view, this._map);
    this._show({ ...(seen ?? ORIGIN), turn_rad: 0 });
    clearTimeout(this._timer);
    this._timer = undefined;
    this._map.byHand = false;
    this._place = null;
    keepView(this._address, null);
  }

  _keep() {
    clearTimeout(this._timer);
    this._timer = undefined;
    const place = asPlace(this._map.byHand && placeOf(this._map.view, this._map));
    if (place) keepView(this._address, place);
  }
}

class LayoutTool {
  /**
   * @param {MapCanvas} map
   * @param {Where} where
   * @param {LastView} views
   * @param {Send} send
   */
  constructor(map, where, views, send) {
    this._map = map;
    this._views = views;
    this._send = send;
    this._file = html("input", "", { type: "file", accept: ".json,application/json" });
    this._file.hidden = true;
    this._file.addEventListener("change", () => void this._load());
    this._message = html("p", "webmap-layout-word", { role: "status" });
    const content = html(
      "div",
      "webmap-layout",
      { role: "group", "aria-label": "Layout of this page" },
      button("webmap-layout-save", "Save", () => this._save()),
      button("webmap-layout-load", "Load", () => this._file.click()),
      button("webmap-layout-reset", "Reset layout", () => this._reset()),
      this._file,
      this._message,
    );
    const title = "Save or load the layout";
    const group = { order: 2, title, heading: "Layout", content };
    this.destroy = joinSaveMenu(map, where, group).leave;
  }

  _save() {
    const view = asPlace(placeOf(this._map.view, this._map));
    const parts = this._map.layout.read();
    const text = writeLayout(view ? { view, ...parts } : parts);
    offer(new Blob([text], { type: "application/json" }), FILE);
    this._say(view ? `Saved as ${FILE}.` : `Saved as ${FILE}, without the view: a file cannot store this view.`);
  }

  async _load() {
    const file = this._file.files?.[0];
    if (!file) return;
    try {
      checkSize(file.size);
      const layout = readLayout(await file.text());
      this._map.layout.write(layout);
      if (layout.view) {
        // The map first gets its size beside the panels that were opened or closed.
        await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
        this._map.follow(0);
        this._map.setView(viewOf(layout.view, this._map));
      }
      this._say(`Loaded ${file.name}. No command was sent to a robot.`);
    } catch (error) {
      const why = error instanceof LayoutRefused ? error.message : `Cannot read the file: ${error}.`;
      this._say(`${why} Nothing was changed.`, true);
    } finally {
      this._file.value = ""; // the same file can be chosen again
    }
  }

  _reset() {
    this._map.layout.reset();
    this._views.forget();
    this._send({ found: true });
    this._say("The layout is reset.");
  }

  /**
   * @param {string} text
   * @param {boolean} [bad]
   */
  _say(text, bad = false) {
    this._message.classList.toggle("webmap-problem", bad);
    setText(this._message, text);
    this._message.scrollIntoView({ block: "nearest" });
  }
}
