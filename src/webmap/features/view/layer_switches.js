import { readStored, store } from "../../web/stored.js";
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

/** The choice to show only the layers of the selected robot. */
const ONLY = "Selected robot";

/** A badge of health is no drawing: it is shown for each robot. */
const BADGES = "Health";

let maps = 0;

/**
 * A list of the layers of the map, each with a switch.
 *
 * Options: `layers`, names with their CSS selectors; `off`, the names that are off at
 * first; `several_off`, those that are off at first where several robots have one;
 * `legend`, a selector of the page's element with the meaning of the colours.
 *
 * @typedef {{layers?: [string, string][], off?: string[], several_off?: string[],
 *     legend?: string}} Options
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @returns {BrowserPart}
 */
export default function attach(map, options) {
  return new LayerSwitches(map, options);
}

/**
 * @param {[string, string][]} layers
 * @param {Record<string, boolean>} shown
 * @param {string} scope A selector of the element that contains the layers.
 * @param {string} [selected] The id of the selected robot.
 * @returns {string} The style sheet that hides the layers that are off.
 */
export function hidingRules(layers, shown, scope, selected = "") {
  const rules = [];
  if (shown[ONLY]) {
    const all = layers.filter(([name]) => name !== BADGES).map(([, selector]) => selector);
    const others = `[data-layer-of]:not([data-layer-of=${JSON.stringify(selected)}])`;
    rules.push(`${scope} .robot:not(.selected) :is(${all}) { display: none; }`);
    rules.push(`${scope} :is(${all})${others} { display: none; }`);
  }
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

/** @typedef {{topic: string, robot: string}} Drawing `robot`: its name, or none. */

/**
 * Return which drawings of a layer have their own switch: none if there is only one.
 *
 * @param {Drawing[]} drawings The present drawings of the layer.
 * @returns {{common: string[], own: Drawing[]}} In natural order: the topics that are of
 *     no robot or of several, and those that are of one among several robots.
 */
export function switchesOf(drawings) {
  const named = drawings.filter(({ topic }) => topic);
  const several = new Set(named.map(({ robot }) => robot)).size > 1;
  /** @type {Map<string, Set<string>>} */
  const robots = new Map();
  for (const { topic, robot } of named) {
    robots.set(topic, (robots.get(topic) ?? new Set()).add(robot));
  }
  if (robots.size < 2) return { common: [], own: [] };
  /** @type {string[]} */
  const common = [];
  /** @type {Drawing[]} */
  const own = [];
  for (const [topic, [robot, ...others]] of [...robots].sort(([a], [b]) => inOrder(a, b))) {
    if (several && robot !== "" && others.length === 0) own.push({ topic, robot });
    else common.push(topic);
  }
  return { common, own };
}

class LayerSwitches {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   */
  constructor(map, { layers = [], off = [], several_off: severalOff = [], legend = "" }) {
    this._map = map;
    this._layers = layers;
    this._found = Object.fromEntries(off.map((name) => [name, false]));
    this._shown = { ...this._found, ...readChoice() };
    this._severalOff = severalOff;
    /** @type {Record<string, boolean>} What is off because several robots have one. */
    this._many = {};
    this._number = `${++maps}`;
    map.svg.dataset.layers = this._number;
    this._sheet = new CSSStyleSheet();
    document.adoptedStyleSheets.push(this._sheet);
    this._list = html("div", "webmap-layers-list", { role: "group" });
    this._list.setAttribute("aria-label", "Layers");
    this._none = html("p", "webmap-layers-none");
    const menu = { "data-webmap-menu": "" };
    this._robots = html("div", "webmap-layers-robots");
    const colours = legend === "" ? null : document.querySelector(legend);
    const content = [this._list, this._none, this._robots, ...(colours ? [colours] : [])];
    this._details = foldedTool("webmap-layers", "layers", "Layers", menu, ...content);
    this._details.addEventListener("toggle", () => this._look());
    this._offs = [
      onBeat(() => this._look(), PERIOD),
      map.onSelect(() => this._shown[ONLY] && this._apply()),
    ];
    // A page that finds things by name needs the list while it is closed too.
    this._ending = new AbortController();
    const { signal } = this._ending;
    document.addEventListener("webmap-find", () => this._update(), { signal });
    this._take = lay(map, this._details, "top-left");
    /** @type {Map<string, HTMLElement>} */
    this._rows = new Map();
    /** @type {Map<string, Group>} By the name of the robot. */
    this._groups = new Map();
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
    for (const off of this._offs) off();
    this._ending.abort();
    this._leave();
    this._take();
    delete this._map.svg.dataset.layers;
    const sheets = document.adoptedStyleSheets;
    document.adoptedStyleSheets = sheets.filter((sheet) => sheet !== this._sheet);
  }

  _look() {
    for (const name of this._severalOff) this._count(name);
    if (this._details.open) this._update();
  }

  /** @param {string} name A layer that is off at first where several robots have one. */
  _count(name) {
    if (name in this._shown || name in this._many) return;
    const drawings = this._drawings(name, new Map());
    if (new Set(drawings.map(({ robot }) => robot).filter(Boolean)).size < 2) return;
    this._many[name] = false;
    this._check();
    this._apply();
  }

  /**
   * @param {string} name A layer.
   * @param {Map<string, string>} names The name of each robot, by its id.
   * @returns {Drawing[]}
   */
  _drawings(name, names) {
    const [, selector = ""] = this._layers.find(([each]) => each === name) ?? [];
    if (selector === "") return [];
    return [...this._map.world.querySelectorAll(selector)].map((drawing) => {
      const { layer = "", layerOf = "" } = /** @type {SVGElement} */ (drawing).dataset;
      const inside = drawing.closest(".robot")?.getAttribute("data-name");
      return { topic: layer, robot: inside ?? names.get(layerOf) ?? layerOf };
    });
  }

  /** List the present layers of the map. */
  _update() {
    const there = new Set();
    const robots = [...this._map.world.querySelectorAll(".robot")].map((robot) => [
      robot.getAttribute("data-robot") ?? "",
      robot.getAttribute("data-name") ?? "",
    ]);
    const byId = new Map(/** @type {[string, string][]} */ (robots));
    if (byId.size > 1) there.add(ONLY);
    /** @type {Map<string, string[]>} The keys of each robot. */
    const owned = new Map();
    for (const [name] of this._layers) {
      const drawings = this._drawings(name, byId);
      if (drawings.length === 0) continue;
      there.add(name);
      const { common, own } = switchesOf(drawings);
      for (const one of common.slice(0, MOST)) there.add(name + OF + one);
      this._note(name, common.length - MOST);
      for (const { topic, robot } of own) {
        owned.set(robot, [...(owned.get(robot) ?? []), name + OF + topic]);
      }
    }
    for (const key of there) if (!this._rows.has(key)) this._add(key);
    for (const [key, row] of this._rows) setHidden(row, !there.has(key));
    this._group(owned);
    setText(this._none, there.size > 0 ? "" : "No layers yet.");
  }

  /** @param {string} key A layer, or one of its drawings. */
  _add(key) {
    const [name, one = ""] = key.split(OF);
    this._rows.set(key, key === ONLY ? this._whose() : this._switch(key, one || name));
    this._arrange();
  }

  /** Make the choice between the layers of all robots and those of the selected one. */
  _whose() {
    const choices = ["All robots", ONLY].map((text) => {
      const value = text === ONLY ? "on" : "off";
      const name = `webmap-layers-${this._number}`;
      const box = this._box(ONLY, { type: "radio", name, value });
      return html("label", "webmap-row webmap-layers-row", {}, box, text);
    });
    const names = { role: "radiogroup", "aria-label": "Whose layers are shown" };
    return html("div", "webmap-row wraps webmap-layers-whose", names, ...choices);
  }

  /**
   * @param {string} key A layer, one of its drawings, or the choice of robots.
   * @param {Record<string, string>} attributes
   */
  _box(key, attributes) {
    const box = html("input", "", { ...attributes, "data-key": key });
    box.checked = this._isOn(key) === (box.value === "on");
    box.addEventListener("change", () => {
      this._shown[key] = box.checked === (box.value === "on");
      store(KEPT, this._shown);
      this._apply();
    });
    return box;
  }

  /**
   * @param {string} key A layer, or one of its drawings.
   * @param {string} text
   */
  _switch(key, text) {
    const [name, one = ""] = key.split(OF);
    const box = this._box(key, { type: "checkbox" });
    const kind = one ? "webmap-row webmap-layers-row one" : "webmap-row webmap-layers-row";
    const row = html("label", kind, {}, box, html("span", "", { dir: "auto" }, text));
    if (one) row.title = `${name}: ${one}`;
    return row;
  }

  /** @param {string} key */
  _isOn(key) {
    return key === ONLY ? this._shown[ONLY] === true : this._now()[key] !== false;
  }

  /** @returns {Record<string, boolean>} What is off now, and what the viewer has chosen. */
  _now() {
    return { ...this._many, ...this._shown };
  }

  /** Show in each box whether its layer is on. */
  _check() {
    /** @type {NodeListOf<HTMLInputElement>} */
    const boxes = this._details.querySelectorAll("[data-key]");
    for (const box of boxes) {
      box.checked = this._isOn(box.dataset.key ?? "") === (box.value === "on");
    }
  }

  /**
   * List the layers of each robot below its name.
   *
   * @param {Map<string, string[]>} owned The keys of each robot.
   */
  _group(owned) {
    for (const [robot, { element }] of this._groups) {
      if (owned.has(robot)) continue;
      element.remove();
      this._groups.delete(robot);
    }
    [...owned.keys()].sort(inOrder).forEach((robot, index) => {
      const keys = owned.get(robot) ?? [];
      let group = this._groups.get(robot);
      if (!group) {
        const title = html("summary", "", { dir: "auto", title: robot }, robot);
        const element = html("details", "webmap-layers-robot", {}, title);
        element.addEventListener("toggle", () => this._update());
        group = { element, keys: "" };
        this._groups.set(robot, group);
      }
      const there = this._robots.children[index] ?? null;
      if (there !== group.element) this._robots.insertBefore(group.element, there);
      // The lines of a folded group are not made: a hundred robots have five hundred.
      const wanted = group.element.open ? keys.join() : "";
      if (wanted === group.keys) return;
      group.keys = wanted;
      const rows = wanted === "" ? [] : keys.map((key) => this._switch(key, textOf(key, keys)));
      group.element.replaceChildren(/** @type {Node} */ (group.element.firstChild), ...rows);
    });
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
    const note = known ?? html("p", "webmap-row webmap-layers-row one");
    setText(note, `${more} more: “${name}” switches all of them`);
    setHidden(note, more <= 0);
    if (known) return;
    this._notes.set(name, note);
    this._arrange();
  }

  /** Sort the rows: each layer, then its drawings, then its note. */
  _arrange() {
    const names = [ONLY, ...this._layers.map(([name]) => name)];
    const rows = names.flatMap((name) => {
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
    store(KEPT, this._shown);
    this._check();
    this._details.open = open;
    this._apply();
  }

  _apply() {
    const scope = `[data-layers="${this._number}"]`;
    const selected = this._map.selected ?? "";
    this._sheet.replaceSync(hidingRules(this._layers, this._now(), scope, selected));
    this._map.crowd.restyle();
    this._map.crowd.settle();
  }
}

/** @typedef {{element: HTMLDetailsElement, keys: string}} Group */

/**
 * @param {string} key A drawing of a robot.
 * @param {string[]} keys All drawings of the robot.
 * @returns {string} Its layer; with the topic if the robot has several of the layer.
 */
function textOf(key, keys) {
  const [name, topic] = key.split(OF);
  const alone = keys.filter((each) => each.startsWith(name + OF)).length === 1;
  return alone ? name : `${name}: ${topic}`;
}

/** @returns {Record<string, boolean>} The choice stored in this browser. */
function readChoice() {
  const choices = Object.entries(readStored(KEPT) ?? {});
  return Object.fromEntries(choices.filter(([, on]) => typeof on === "boolean"));
}
