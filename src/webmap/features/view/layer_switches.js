import { html, inOrder, onBeat, setHidden, setText } from "../../web/tools/elements.js";
import { lay } from "../../web/tools/overlay.js";
import { foldedTool } from "../../web/tools/tool.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

/** The key of the choice in this browser's storage. */
const KEPT = "webmap.layers";

/** Separates a layer's name from that of one of its drawings in the stored choice. */
const OF = "\n";

/** Greatest number of listed drawings of a layer; others are only switched together. */
const MOST = 16;

/** Beats between two updates of an open list. */
const PERIOD = 4;

let maps = 0;

/**
 * A list of the layers of the map, each with a switch.
 *
 * Options: `layers`, names with their CSS selectors; `off`, the names that are off at
 * first.
 *
 * @param {MapCanvas} map
 * @param {{layers?: [string, string][], off?: string[]}} options
 * @returns {BrowserPart}
 */
export default function attach(map, options) {
  const switches = new LayerSwitches(map, options);
  return { destroy: () => switches.destroy() };
}

/**
 * @param {[string, string][]} layers
 * @param {Record<string, boolean>} shown
 * @param {string} scope A selector of the element that contains the layers.
 * @returns {string} The style sheet that hides the layers that are off.
 */
export function hidingRules(layers, shown, scope) {
  const rules = [];
  for (const [name, selector] of layers) {
    if (shown[name] === false) rules.push(`${scope} :is(${selector}) { display: none; }`);
    for (const key of Object.keys(shown)) {
      if (!key.startsWith(name + OF) || shown[key] !== false) continue;
      const one = JSON.stringify(key.slice(name.length + OF.length));
      rules.push(`${scope} :is(${selector})[data-layer=${one}] { display: none; }`);
    }
  }
  return rules.join("\n");
}

/**
 * @param {Iterable<{dataset: DOMStringMap}>} drawings The present drawings of a layer.
 * @returns {string[]} The drawings that have their own switch, in natural order; none
 *     if there is only one drawing.
 */
export function drawingNames(drawings) {
  const found = new Set();
  for (const { dataset } of drawings) if (dataset.layer) found.add(dataset.layer);
  const names = [...found].sort(inOrder);
  return names.length > 1 ? names : [];
}

class LayerSwitches {
  /**
   * @param {MapCanvas} map
   * @param {{layers?: [string, string][], off?: string[]}} options
   */
  constructor(map, { layers = [], off = [] }) {
    this._map = map;
    this._layers = layers;
    this._found = Object.fromEntries(off.map((name) => [name, false]));
    this._shown = { ...this._found, ...readChoice() };
    this._number = `${++maps}`;
    map.svg.dataset.layers = this._number;
    this._sheet = new CSSStyleSheet();
    document.adoptedStyleSheets.push(this._sheet);
    this._list = html("div", "webmap-layers-list", { role: "group" });
    this._list.setAttribute("aria-label", "Layers");
    this._none = html("p", "webmap-layers-none");
    const menu = { "data-webmap-menu": "" };
    const content = [this._list, this._none];
    this._details = foldedTool("webmap-layers", "layers", "Layers", menu, ...content);
    this._details.addEventListener("toggle", () => this._look());
    this._off = onBeat(() => this._look(), PERIOD);
    // A page that finds things by name needs the list while it is closed too.
    this._ending = new AbortController();
    const { signal } = this._ending;
    document.addEventListener("webmap-find", () => this._update(), { signal });
    this._take = lay(map, this._details, "top-left");
    /** @type {Map<string, HTMLElement>} */
    this._rows = new Map();
    /** For each layer the line with the number of drawings that have no switch. */
    /** @type {Map<string, HTMLElement>} */
    this._notes = new Map();
    this._leave = map.layout.add("layers", {
      read: () => ({ open: this._details.open, shown: { ...this._shown } }),
      write: ({ open, shown }) => this._lay(open, shown),
      reset: () => this._lay(false, this._found),
    });
    this._apply();
  }

  destroy() {
    this._off();
    this._ending.abort();
    this._leave();
    this._take();
    delete this._map.svg.dataset.layers;
    const sheets = document.adoptedStyleSheets;
    document.adoptedStyleSheets = sheets.filter((sheet) => sheet !== this._sheet);
  }

  _look() {
    if (this._details.open) this._update();
  }

  /** List the present layers of the map. */
  _update() {
    const there = new Set();
    for (const [name, selector] of this._layers) {
      /** @type {NodeListOf<SVGElement>} */
      const drawings = this._map.world.querySelectorAll(selector);
      if (drawings.length === 0) continue;
      there.add(name);
      const names = drawingNames(drawings);
      for (const one of names.slice(0, MOST)) there.add(name + OF + one);
      this._note(name, names.length - MOST);
    }
    for (const key of there) if (!this._rows.has(key)) this._add(key);
    for (const [key, row] of this._rows) setHidden(row, !there.has(key));
    setText(this._none, there.size > 0 ? "" : "No layers yet.");
  }

  /** @param {string} key A layer, or one of its drawings. */
  _add(key) {
    const [name, one = ""] = key.split(OF);
    const box = html("input", "", { type: "checkbox" });
    box.checked = this._shown[key] !== false;
    box.addEventListener("change", () => {
      this._shown[key] = box.checked;
      storeChoice(this._shown);
      this._apply();
    });
    const kind = one ? "webmap-layers-row one" : "webmap-layers-row";
    const row = html("label", kind, {}, box, html("span", "", {}, one || name));
    if (one) row.title = `${name}: ${one}`;
    this._rows.set(key, row);
    this._arrange();
  }

  /**
   * Show that there are more drawings than switches.
   *
   * @param {string} name Of the layer.
   * @param {number} more
   */
  _note(name, more) {
    const known = this._notes.get(name);
    if (more <= 0 && !known) return;
    const note = known ?? html("p", "webmap-layers-row one");
    setText(note, `${more} more: “${name}” switches all of them`);
    setHidden(note, more <= 0);
    if (known) return;
    this._notes.set(name, note);
    this._arrange();
  }

  /** Sort the rows: each layer, then its drawings, then its note. */
  _arrange() {
    const rows = this._layers.flatMap(([name]) => {
      const keys = [...this._rows.keys()].filter((key) => key.split(OF)[0] === name);
      const found = keys.sort(inOrder).map((key) => this._rows.get(key));
      return [...found, this._notes.get(name)].filter((row) => row !== undefined);
    });
    this._list.replaceChildren(...rows);
  }

  /**
   * @param {boolean} open Whether the list is unfolded.
   * @param {Record<string, boolean>} shown
   */
  _lay(open, shown) {
    this._shown = { ...shown };
    storeChoice(this._shown);
    for (const [key, row] of this._rows) {
      const box = row.querySelector("input");
      if (box) box.checked = this._shown[key] !== false;
    }
    this._details.open = open;
    this._apply();
  }

  _apply() {
    const scope = `[data-layers="${this._number}"]`;
    this._sheet.replaceSync(hidingRules(this._layers, this._shown, scope));
    this._map.crowd.restyle();
    this._map.crowd.settle();
  }
}

/** @returns {Record<string, boolean>} The choice stored in this browser. */
function readChoice() {
  try {
    const value = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    const choices = Object.entries(value).filter(([, on]) => typeof on === "boolean");
    return Object.fromEntries(choices);
  } catch {
    return {}; // no storage, or not written by WebMap
  }
}

/** @param {Record<string, boolean>} shown */
function storeChoice(shown) {
  try {
    localStorage.setItem(KEPT, JSON.stringify(shown));
  } catch {
    // Without storage the choice is not kept.
  }
}
