import { html, say } from "./elements.js";
import { lay } from "./overlay.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('../halves.js').Half} Half */

/** Where the choice is kept in this browser. */
const KEPT = "webmap.layers";

/** How often an open list looks what there is, in milliseconds. */
const PERIOD = 1000;

let maps = 0;

/**
 * A list of what the map shows, each to be switched on and off.
 *
 * Options: `layers`, names with their CSS selectors; `off`, the names of those that are
 * off at first.
 *
 * @param {MapCanvas} map
 * @param {{layers?: [string, string][], off?: string[]}} options
 * @returns {Half}
 */
export default function attach(map, options) {
  const switches = new LayerSwitches(map, options);
  return { destroy: () => switches.destroy() };
}

/**
 * @param {[string, string][]} layers
 * @param {Record<string, boolean>} shown
 * @param {string} scope A selector of what the layers are in.
 * @returns {string} The style sheet that hides what is not shown.
 */
export function hiding(layers, shown, scope) {
  return layers
    .filter(([name]) => shown[name] === false)
    .map(([, selector]) => `${scope} :is(${selector}) { display: none; }`)
    .join("\n");
}

class LayerSwitches {
  /**
   * @param {MapCanvas} map
   * @param {{layers?: [string, string][], off?: string[]}} options
   */
  constructor(map, { layers = [], off = [] }) {
    this._map = map;
    this._layers = layers;
    this._shown = { ...Object.fromEntries(off.map((name) => [name, false])), ...kept() };
    this._number = `${++maps}`;
    map.svg.dataset.layers = this._number;
    this._sheet = new CSSStyleSheet();
    document.adoptedStyleSheets.push(this._sheet);
    this._list = html("div", "webmap-layers-list", { role: "group" });
    this._list.setAttribute("aria-label", "Layers");
    this._none = html("p", "webmap-layers-none");
    this._details = html(
      "details",
      "webmap-panel webmap-layers",
      {},
      html("summary", "", {}, "Layers"),
      this._list,
      this._none,
    );
    this._details.addEventListener("toggle", () => this._look());
    this._timer = setInterval(() => this._look(), PERIOD);
    this._take = lay(map, this._details, "top-left");
    /** @type {Map<string, HTMLElement>} */
    this._rows = new Map();
    this._apply();
  }

  destroy() {
    clearInterval(this._timer);
    this._take();
    delete this._map.svg.dataset.layers;
    const sheets = document.adoptedStyleSheets;
    document.adoptedStyleSheets = sheets.filter((sheet) => sheet !== this._sheet);
  }

  /** List what is on the map at the moment. */
  _look() {
    if (!this._details.open) return;
    for (const [name, selector] of this._layers) {
      const there = this._map.world.querySelector(selector) !== null;
      const row = this._rows.get(name);
      if (row) row.hidden = !there;
      else if (there) this._add(name);
    }
    const any = [...this._rows.values()].some((row) => !row.hidden);
    say(this._none, any ? "" : "There is nothing to switch.");
  }

  /** @param {string} name */
  _add(name) {
    const box = html("input", "", { type: "checkbox" });
    box.checked = this._shown[name] !== false;
    box.addEventListener("change", () => {
      this._shown[name] = box.checked;
      keep(this._shown);
      this._apply();
    });
    const row = html("label", "webmap-layers-row", {}, box, name);
    this._rows.set(name, row);
    // In the order of the layers, whichever came first.
    const order = this._layers.map(([known]) => known);
    const rows = [...this._rows].sort(([a], [b]) => order.indexOf(a) - order.indexOf(b));
    this._list.replaceChildren(...rows.map(([, element]) => element));
  }

  _apply() {
    const scope = `[data-layers="${this._number}"]`;
    this._sheet.replaceSync(hiding(this._layers, this._shown, scope));
  }
}

/** @returns {Record<string, boolean>} What was chosen before in this browser. */
function kept() {
  try {
    const value = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    return typeof value === "object" && value !== null ? value : {};
  } catch {
    return {}; // storage may be forbidden, or hold what is not ours
  }
}

/** @param {Record<string, boolean>} shown */
function keep(shown) {
  try {
    localStorage.setItem(KEPT, JSON.stringify(shown));
  } catch {
    // Then it is chosen again next time.
  }
}
