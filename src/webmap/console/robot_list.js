/**
 * The list of robots: search, order, groups, counts by state that filter, the next robot
 * that needs someone, and keys.
 * The choice is a part of the layout, and stored in the browser.
 */

import { checkedList } from "../web/layout.js";
import { readStored, store } from "../web/stored.js";
import {
  byId,
  forgetOthers,
  html,
  inOrder,
  keepOrder,
  onBeat,
  setAttribute,
  setHidden,
  setText,
  svg,
  typing,
} from "../web/tools/elements.js";
import { endOf } from "../web/tools/overlay.js";

/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */
/** @typedef {Listed & {row: HTMLElement, need: string}} Row */

/** The key of the choice in this browser's storage. */
const KEPT = "webmap.list";

/** Beats between two counts, and between two changes of the order. */
const COUNT_EVERY = 2;
const ORDER_EVERY = 8;

/**
 * @param {MapCanvas} map
 * @param {AbortSignal} signal
 * @returns {() => void} Leaves the map and its layout.
 */
export function listenToRobots(map, signal) {
  const list = new RobotList(map, signal);
  const choosing = () => byId("robots").classList.toggle("choosing", map.selected !== null);
  choosing();
  return endOf(
    map.onSelect(choosing),
    map.layout.add("list", {
      read: () => list.choice,
      write: (choice) => list.choose(choice),
      reset: () => list.choose(AT_FIRST),
    }),
  );
}

class RobotList {
  /**
   * @param {MapCanvas} map
   * @param {AbortSignal} signal
   */
  constructor(map, signal) {
    this._map = map;
    this._list = byId("robots");
    this._attention = byId("attention");
    this._next = byId("next-need");
    /** @type {string | null} The robot whose selection was sent and is not shown yet. */
    this._asked = null;
    this._search = /** @type {HTMLInputElement} */ (byId("search"));
    this._order = /** @type {HTMLSelectElement} */ (byId("robot-order"));
    this._group = /** @type {HTMLSelectElement} */ (byId("robot-group"));
    this._size = /** @type {HTMLSelectElement} */ (byId("robot-rows"));
    /** @type {Choice} */
    this.choice = kept();
    /** @type {WeakMap<HTMLElement, number>} When each row was seen first. */
    this._added = new WeakMap();
    this._count = 0;
    /** @type {Map<string, HTMLButtonElement>} */
    this._chips = new Map();
    /** Whether a mouse is over the list; a finger leaves no trace. */
    this._over = false;
    this._listen(signal);
    this._listenToSearch(signal);
    this._listenToKeys(signal);
    this._listenToNeeds(signal);
    this._update();
    this._arrange();
  }

  /** @param {Partial<Choice>} part */
  choose(part) {
    this.choice = { ...this.choice, ...part };
    store(KEPT, this.choice);
    this._update();
    this._arrange();
  }

  /** @param {AbortSignal} signal */
  _listen(signal) {
    const over = (/** @type {PointerEvent} */ { type, pointerType }) => {
      this._over = type === "pointerenter" && pointerType !== "touch";
    };
    this._list.addEventListener("pointerenter", over, { signal });
    this._list.addEventListener("pointerleave", over, { signal });
    const chosen = () => {
      const { value: order } = this._order;
      const { value: group } = this._group;
      const { value: rows } = this._size;
      this.choose(/** @type {Partial<Choice>} */ ({ order, group, rows }));
    };
    this._size.addEventListener("change", chosen, { signal });
    this._order.addEventListener("change", chosen, { signal });
    this._group.addEventListener("change", chosen, { signal });
    const arrange = () => {
      const used = this._over || this._list.contains(document.activeElement);
      if (!used) this._arrange();
    };
    const newcomers = new MutationObserver(() => {
      this._update();
      arrange();
    });
    newcomers.observe(this._list, { childList: true });
    // The card makes the list lower.
    const resized = new ResizeObserver(() => this._reveal());
    resized.observe(this._list);
    const off = endOf(onBeat(() => this._update(), COUNT_EVERY), onBeat(arrange, ORDER_EVERY));
    signal.addEventListener("abort", () => {
      newcomers.disconnect();
      resized.disconnect();
      off();
    });
  }

  /** @returns {Row[]} In the order of the page. */
  _rows() {
    return [...this._list.querySelectorAll(":scope > .row")].flatMap((row) => {
      if (!(row instanceof HTMLElement)) return [];
      const added = this._added.get(row) ?? this._count++;
      this._added.set(row, added);
      const { group = "", rank, tag = "", bridge = "", charge, need = "" } = row.dataset;
      const name = row.querySelector(".name")?.textContent ?? "";
      return [
        {
          row,
          name,
          group,
          rank: Number(rank ?? Infinity),
          need,
          tag,
          bridge,
          charge: charge === undefined ? null : Number(charge),
          added,
        },
      ];
    });
  }

  /** Show the tools of a long list, the counts, and the robots that the filter leaves. */
  _update() {
    const rows = this._rows();
    const long = rows.length > MANY || rows.some(({ tag }) => tag);
    setHidden(byId("robot-tools"), !long);
    byId("robots-part").classList.toggle("long", long);
    byId("robots-part").classList.toggle("compact", long && this.choice.rows === "compact");
    this._size.value = this.choice.rows;
    this._order.value = orderFor(this.choice.order, rows.length);
    this._group.value = this.choice.group;
    const states = long ? this.choice.states : [];
    this._showChips(rows, long);
    const wanted = this._search.value.trim();
    for (const robot of rows) {
      robot.row.classList.toggle("filtered", !isShown(robot, wanted, states));
    }
    for (const title of this._list.querySelectorAll(":scope > .group-name")) {
      let next = title.nextElementSibling;
      while (next?.classList.contains("filtered")) next = next.nextElementSibling;
      title.classList.toggle("filtered", !next?.classList.contains("row"));
    }
    const found = this._buttons().length;
    const filtered = wanted !== "" || states.length > 0;
    setHidden(byId("select-shown"), !filtered || found < 2);
    const none = rows.length > 0 && found === 0;
    setText(byId("not-found"), none ? noneText(wanted, states) : "");
  }

  /**
   * Show the groups that need someone, and those that are chosen, above the list.
   *
   * @param {Row[]} rows
   * @param {boolean} long
   */
  _showChips(rows, long) {
    const { states } = this.choice;
    const counts = countsOf(rows, states);
    const groups = new Set(counts.map(({ group }) => group));
    forgetOthers(this._chips, groups, (chip) => chip.remove());
    const firsts = new Map([...rows].reverse().map((row) => [row.group, row]));
    /** @type {HTMLElement[]} */
    const urgent = [];
    /** @type {HTMLElement[]} */
    const others = [];
    for (const { group, count } of counts) {
      const chip = this._chips.get(group) ?? this._chip(group);
      this._chips.set(group, chip);
      const first = firsts.get(group);
      const shape = first?.row.querySelector(".shape.now use")?.getAttribute("href");
      const use = chip.querySelector("use");
      if (shape && use) setAttribute(use, "href", shape);
      if (first) setAttribute(chip, "data-tone", first.row.dataset.tone ?? "");
      setText(/** @type {Element} */ (chip.lastElementChild), `${count} ${group}`);
      setAttribute(chip, "aria-pressed", `${states.includes(group)}`);
      (first?.need || states.includes(group) ? urgent : others).push(chip);
    }
    setHidden(this._attention, !long || urgent.length === 0);
    const needed = [...firsts.values()].some(({ need }) => need);
    setHidden(this._next, !needed);
    keepOrder(this._attention, [...urgent, this._next]);
    keepOrder(byId("other-states"), others);
  }

  /** @param {string} group */
  _chip(group) {
    const shape = svg("svg", { class: "shape", "aria-hidden": "true" }, svg("use", {}));
    const chip = html("button", "chip", { type: "button" }, shape, html("span", ""));
    chip.addEventListener("click", () => {
      const { states } = this.choice;
      const others = states.filter((each) => each !== group);
      this.choose({ states: others.length < states.length ? others : [...states, group] });
    });
    return chip;
  }

  /**
   * `N` selects the next robot that needs someone, `Shift` and `N` the one before.
   *
   * @param {AbortSignal} signal
   */
  _listenToNeeds(signal) {
    this._next.addEventListener("click", () => this._select(1), { signal });
    const key = (/** @type {KeyboardEvent} */ event) => {
      if (event.key.toLowerCase() !== "n" || event.repeat || typing(event)) return;
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this._select(event.shiftKey ? -1 : 1);
    };
    document.addEventListener("keydown", key, { signal });
    const off = this._map.onSelect(() => {
      this._asked = null;
    });
    signal.addEventListener("abort", off);
  }

  /** @param {1 | -1} by */
  _select(by) {
    const rows = this._rows();
    const shown = rows.filter(({ row }) => !row.classList.contains("filtered"));
    const ring = shown.some(({ need }) => need) ? shown : rows;
    const from = this._asked ?? this._map.selected;
    const at = ring.findIndex(({ row }) => row.dataset.robot === from);
    const next = ring[nextNeed(ring, at, by)]?.row;
    if (!next) return;
    this._asked = next.dataset.robot ?? null;
    next.querySelector("button")?.click();
  }

  /** Scroll the list to the selected robot, so that the card does not cover its line. */
  _reveal() {
    const robot = CSS.escape(this._map.selected ?? "");
    this._list.querySelector(`:scope > [data-robot="${robot}"]`)?.scrollIntoView({
      block: "nearest",
    });
  }

  /** Put the rows in order, below the names of their groups. */
  _arrange() {
    const rows = this._rows();
    const long = !byId("robot-tools").hidden;
    const groups = arranged(rows, long ? this.choice : AT_FIRST);
    const old = [...this._list.querySelectorAll(":scope > .group-name")];
    const wanted = groups.flatMap(({ name, robots }) => {
      const text = `${name} (${robots.length})`;
      const known = old.find((each) => each.textContent === text);
      const title = known ?? html("li", "webmap-one-line minor group-name", { dir: "auto", title: name }, text);
      return [...(name ? [title] : []), ...robots.map(({ row }) => row)];
    });
    for (const title of old) if (!wanted.includes(title)) title.remove();
    keepOrder(this._list, wanted);
  }

  /** @returns {HTMLElement[]} The buttons that select the listed robots. */
  _buttons() {
    const path = ":scope > .row:not(.filtered) [aria-pressed]";
    return /** @type {HTMLElement[]} */ ([...this._list.querySelectorAll(path)]);
  }

  /**
   * Enter selects the robot if the search leaves only one.
   *
   * @param {AbortSignal} signal
   */
  _listenToSearch(signal) {
    const input = this._search;
    input.addEventListener("input", () => this._update(), { signal });
    const choose = (/** @type {KeyboardEvent} */ event) => {
      const [first, ...more] = this._buttons();
      if (event.key === "Enter" && more.length === 0) first?.click();
      if (event.key !== "ArrowDown" || !first) return;
      event.preventDefault();
      first.focus();
    };
    input.addEventListener("keydown", choose, { signal });
    const key = (/** @type {KeyboardEvent} */ event) => {
      if (event.key !== "/" || event.ctrlKey || event.metaKey || typing(event)) return;
      event.preventDefault();
      input.focus();
    };
    document.addEventListener("keydown", key, { signal });
  }

  /**
   * The arrow keys move in the list while the keyboard has brought the focus there.
   * After a click on a robot they drive it, as everywhere else.
   *
   * @param {AbortSignal} signal
   */
  _listenToKeys(signal) {
    let clicked = false;
    const press = () => {
      clicked = true;
    };
    this._list.addEventListener("pointerdown", press, { signal });
    const leave = (/** @type {FocusEvent} */ { relatedTarget }) => {
      if (!(relatedTarget instanceof Node && this._list.contains(relatedTarget))) clicked = false;
    };
    this._list.addEventListener("focusout", leave, { signal });
    const key = (/** @type {KeyboardEvent} */ event) => {
      if (event.key === "Tab") clicked = false;
      const buttons = this._buttons();
      const at = buttons.findIndex((each) => each === document.activeElement);
      const to = { ArrowUp: at - 1, ArrowDown: at + 1, Home: 0, End: buttons.length - 1 }[event.key];
      if (to === undefined || at < 0 || clicked) return;
      event.preventDefault();
      event.stopPropagation();
      buttons[to]?.focus();
    };
    this._list.addEventListener("keydown", key, { signal });
  }
}

/**
 * Return the robot that the key `N` selects. Of a group with one fault, such as that of
 * a bridge, only the first robot counts.
 *
 * @param {{group: string, need: string}[]} robots
 * @param {number} at The place of the selected robot; -1 for none.
 * @param {1 | -1} by The direction.
 * @returns {number} Its place; -1 if no other robot needs someone.
 */
export function nextNeed(robots, at, by) {
  const seen = new Set();
  const places = robots.flatMap(({ group, need }, place) => {
    if (!need || (need === "one" && seen.has(group))) return [];
    seen.add(group);
    return place === at ? [] : [place];
  });
  const ahead = by > 0 ? places : [...places].reverse();
  return ahead.find((place) => at < 0 || (place - at) * by > 0) ?? ahead[0] ?? -1;
}

/**
 * @param {string} wanted
 * @param {string[]} states
 */
function noneText(wanted, states) {
  const filter = states.length > 0 ? ` among those that are ${states.join(" or ")}` : "";
  if (wanted === "") return `No robot${filter}.`;
  return `No robot has “${wanted}” in its name${filter}.`;
}

/** @returns {Choice} */
function kept() {
  try {
    return checkedList(readStored(KEPT), KEPT);
  } catch {
    return AT_FIRST;
  }
}

/**
 * The order, the groups and the filter of the list of robots, without the page.
 *
 * @typedef {import('../web/layout.js').List} Choice What the operator has chosen.
 * @typedef {Choice['order']} Order
 *
 * @typedef {object} Listed
 * @property {string} name
 * @property {string} group The group of its state, such as `stopped`.
 * @property {number} rank The place of that group; 0 is the worst.
 * @property {string} tag Empty if it has none.
 * @property {string} bridge Empty if it has none.
 * @property {number | null} charge In percent; null if it is unknown.
 * @property {number} added The place among the robots as they were added.
 */

/** With more robots than this, the list has the worst first. */
export const MANY = 8;

/** @type {Choice} */
export const AT_FIRST = { order: "auto", group: "none", rows: "usual", states: [] };

/** @type {Record<Order, (one: Listed, other: Listed) => number>} */
const COMPARE = {
  auto: () => 0,
  added: () => 0,
  name: () => 0,
  state: (one, other) => one.rank - other.rank,
  battery: (one, other) => (one.charge ?? Infinity) - (other.charge ?? Infinity) || 0,
};

/**
 * @param {Order} order
 * @param {number} count Number of robots.
 * @returns {Order} The order that is used.
 */
export function orderFor(order, count) {
  if (order !== "auto") return order;
  return count > MANY ? "state" : "added";
}

/**
 * Return the robots in order, with the name of each group before its robots.
 *
 * @template {Listed} T
 * @param {T[]} robots
 * @param {Choice} choice
 * @returns {{name: string, robots: T[]}[]} One group without a name if there are none.
 */
export function arranged(robots, { order, group }) {
  const used = orderFor(order, robots.length);
  const byName = (/** @type {T} */ one, /** @type {T} */ other) =>
    used === "added" ? 0 : inOrder(one.name, other.name);
  const sorted = [...robots].sort(
    (one, other) => COMPARE[used](one, other) || byName(one, other) || one.added - other.added,
  );
  if (group === "none") return [{ name: "", robots: sorted }];
  /** @type {Map<string, T[]>} */
  const groups = new Map();
  for (const robot of sorted) {
    const key = robot[group];
    groups.set(key, [...(groups.get(key) ?? []), robot]);
  }
  const names = [...groups.keys()].sort(
    (one, other) => Number(one === "") - Number(other === "") || inOrder(one, other),
  );
  return names.map((name) => ({
    name: name || `No ${group}`,
    robots: groups.get(name) ?? [],
  }));
}

/**
 * Return how many robots are in each group of states.
 *
 * @param {Listed[]} robots
 * @param {string[]} always Groups that are listed even without a robot.
 * @returns {{group: string, count: number}[]} The worst first, those without a robot
 *     last.
 */
export function countsOf(robots, always) {
  const worst = [...robots].sort((one, other) => one.rank - other.rank);
  const counts = new Map(worst.map(({ group }) => [group, 0]));
  for (const { group } of robots) counts.set(group, (counts.get(group) ?? 0) + 1);
  for (const group of always) if (!counts.has(group)) counts.set(group, 0);
  return [...counts].map(([group, count]) => ({ group, count }));
}

/**
 * @param {Listed} robot
 * @param {string} wanted Part of the name.
 * @param {string[]} states
 */
export function isShown({ name, group }, wanted, states) {
  const named = name.toLowerCase().includes(wanted.trim().toLowerCase());
  return named && (states.length === 0 || states.includes(group));
}
