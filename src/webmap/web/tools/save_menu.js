import { devicesOf } from "../inputs/devices.js";
import { html, setHidden, setText, svg } from "./elements.js";
import { endOf, lay, ownPlace } from "./overlay.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/**
 * Position of the button: `place`, a selector of the page's own element, and `classes`
 * of the button there; without a place it is over the map.
 *
 * @typedef {{place?: string, classes?: string}} Where
 */

/**
 * @typedef {object} Group
 * @property {number} order Groups are sorted by this.
 * @property {string} title Purpose of the button, in its title.
 * @property {string} heading
 * @property {HTMLElement} content
 */

const ICON = "M12 3.5v11M7.5 10.5l4.5 4.5 4.5-4.5M4.5 20h15";

/** Pixels between the menu and the map's bottom, which a sheet may cover. */
const GAP = 24;

/** @type {WeakMap<MapCanvas, Map<string, SaveMenu>>} */
const menus = new WeakMap();

/**
 * Add a group to the save menu: one button for all groups, to save space.
 *
 * @param {MapCanvas} map
 * @param {Where} where Modules with the same place share a button.
 * @param {Group} group
 * @returns {{menu: SaveMenu, leave: () => void}}
 */
export function joinSaveMenu(map, where, group) {
  const { place = "" } = where;
  const there = menus.get(map) ?? new Map();
  menus.set(map, there);
  const menu = there.get(place) ?? new SaveMenu(map, where);
  there.set(place, menu);
  const remove = menu.add(group);
  const leave = () => {
    remove();
    if (!menu.empty) return;
    there.delete(place);
    menu.destroy();
  };
  return { menu, leave };
}

/** A button that opens a menu of things to save. */
class SaveMenu {
  /**
   * @param {MapCanvas} map
   * @param {Where} where
   */
  constructor(map, { place = "", classes = "" }) {
    this._map = map;
    /** @type {Map<Group, HTMLElement>} */
    this._groups = new Map();
    const icon = svg("path", { d: ICON });
    this._go = html(
      "button",
      `webmap-export-go ${classes || "webmap-button"}`,
      { type: "button", "aria-expanded": "false", "aria-haspopup": "true" },
      svg("svg", { viewBox: "0 0 24 24", class: "icon webmap-symbol", "aria-hidden": "true" }, icon),
    );
    this._go.addEventListener("click", () => this._open(Boolean(this._menu.hidden)));
    this._menu = html("div", "webmap-panel webmap-export-menu");
    this._message = html("span", "webmap-export-word", { role: "status" });
    this._element = html("div", "webmap-export", {}, this._go, this._menu, this._message);
    const ending = new AbortController();
    const { signal } = ending;
    const outside = (/** @type {Event} */ event) => {
      if (event.target instanceof Node && !this._element.contains(event.target)) {
        this._open(false);
      }
    };
    addEventListener("pointerdown", outside, { signal, capture: true });
    addEventListener("focusin", outside, { signal });
    // For pages without control of robots, where nothing else handles Escape.
    const escape = (/** @type {KeyboardEvent} */ event) => {
      if (event.key === "Escape") this._leave();
    };
    this._element.addEventListener("keydown", escape, { signal });
    this.destroy = endOf(
      () => ending.abort(),
      this._lay(place),
      devicesOf(map.drive).claimEscape(() => this._leave()),
    );
    this._open(false);
  }

  get empty() {
    return this._groups.size === 0;
  }

  /**
   * @param {Group} group
   * @returns {() => void} Removes it.
   */
  add(group) {
    const head = html("p", "webmap-muted webmap-export-head", { "aria-hidden": "true" }, group.heading);
    const element = html("div", "webmap-export-group", {}, head, group.content);
    this._groups.set(group, element);
    this._list();
    return () => {
      this._groups.delete(group);
      this._list();
    };
  }

  _list() {
    const groups = [...this._groups].sort(([one], [other]) => one.order - other.order);
    const title = groups.map(([group]) => group.title).join("; ");
    this._go.setAttribute("aria-label", title);
    this._go.title = title;
    this._menu.replaceChildren(...groups.map(([, element]) => element));
  }

  /** Close the menu and focus the button. */
  close() {
    this._open(false);
    this._go.focus();
  }

  /** @param {string} text Text next to the button while something is saved. */
  showMessage(text) {
    setText(this._message, text);
  }

  /**
   * @param {string} place
   * @returns {() => void}
   */
  _lay(place) {
    if (!ownPlace(place)) this._element.classList.add("webmap-panel");
    return lay(this._map, this._element, "top-left", place);
  }

  /** @returns {boolean} Whether the menu was open. */
  _leave() {
    if (this._menu.hidden) return false;
    this.close();
    return true;
  }

  /** @param {boolean} open */
  _open(open) {
    setHidden(this._menu, !open);
    this._go.setAttribute("aria-expanded", String(open));
    if (!open) return;
    const room = document.documentElement.clientWidth;
    this._element.classList.remove("leftward");
    const { top, right } = this._menu.getBoundingClientRect();
    this._element.classList.toggle("leftward", right > room);
    // Controls below the map, such as STOP, stay visible.
    const end = this._map.svg.getBoundingClientRect().bottom - GAP;
    this._menu.style.maxHeight = end > top ? `${end - top}px` : "";
    this._menu.querySelector("button")?.focus({ preventScroll: true });
  }
}

/** Milliseconds for which the browser may still read an offered file. */
const READ_WITHIN = 60_000;

/**
 * Save a file on the viewer's own machine.
 *
 * @param {Blob} file
 * @param {string} name
 */
export function offer(file, name) {
  const link = html("a", "");
  link.href = URL.createObjectURL(file);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), READ_WITHIN);
}
