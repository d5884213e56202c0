import { WORDS } from "../web/constants.js";
import { forgetOthers, onBeat, svg } from "../web/tools/elements.js";
import { endOf } from "../web/tools/overlay.js";
import { scale as scaled, scaleOf, translate } from "../web/view.js";

/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */

/**
 * Names that do not cover one another on the map, and one mark for robots that overlap
 * in a small picture.
 */

/**
 * Size of texts on the screen, in pixels: about the width of a letter, the height of a
 * line, and the distance from the robot down to the middle of the name.
 */
const LETTER = 8;
const LINE = 18;
const BELOW = 26;

/** With more visible robots than this, only the selected and the worst have names. */
const MOST = 150;

/** So many of the worst robots have the words of their state; others are counted. */
const WORST = 8;

/** Distance in pixels below which two robots overlap. */
const NEAR = 26;

/** Pixels per metre from which a robot is drawn in its true size, and none overlap. */
const TRUE_SIZE = 54;

/** Radius of the mark of several robots, in pixels. */
const RADIUS = 17;

/** Distance in pixels below which such a mark covers another mark or a robot. */
const COVERED = 2 * RADIUS + 4;

/** Most times that all marks are compared. */
const PASSES = 3;

/** Greatest part of the map's size that robots fill after a press on their mark. */
const FILLED = 0.5;

/**
 * A text on the screen: its middle and its size, in pixels.
 *
 * @typedef {object} Name
 * @property {number} x
 * @property {number} y
 * @property {number} width
 * @property {number} [height] One line if missing.
 * @property {boolean} first Whether it is shown in any case.
 * @property {number} [rank] The lowest takes priority over the others.
 */

/**
 * Return which names can be shown without covering one another.
 *
 * @param {Name[]} names
 * @returns {boolean[]} For each name, whether there is room.
 */
export function roomFor(names) {
  const order = names.map((_, index) => index);
  const rank = (/** @type {number} */ index) => names[index].rank ?? 0;
  order.sort(
    (a, b) => Number(names[b].first) - Number(names[a].first) || rank(a) - rank(b) || a - b,
  );
  const shown = names.map(() => false);
  /** @type {Name[]} */
  const placed = [];
  for (const index of order) {
    const name = names[index];
    const free = placed.every(
      (other) =>
        Math.abs(other.y - name.y) >= ((other.height ?? LINE) + (name.height ?? LINE)) / 2 ||
        Math.abs(other.x - name.x) >= (other.width + name.width) / 2,
    );
    if (!free && !name.first) continue;
    shown[index] = true;
    placed.push(name);
  }
  return shown;
}

/** @typedef {{x: number, y: number, alone: boolean}} Place In pixels. */

/**
 * Return which robots overlap. Marks of several robots cover neither one another nor
 * another robot.
 *
 * @param {Place[]} places Robots that are `alone` join no others.
 * @returns {number[][]} The indices of each two or more robots that overlap.
 */
export function clustersOf(places) {
  /** @type {Cluster[]} */
  const clusters = [];
  places.forEach(({ x, y, alone }, index) => {
    // Distance from the first of them: a row of robots does not become one.
    const near = clusters.find((each) => !alone && isNear(places[each.members[0]], { x, y }, NEAR));
    if (near) join(near, { x, y, members: [index] });
    else if (!alone) clusters.push({ x, y, members: [index] });
  });
  for (let pass = 0; pass < PASSES && joinMarks(clusters); pass++);
  return clusters.map(({ members }) => members).filter(({ length }) => length > 1);
}

/** @typedef {{x: number, y: number, members: number[]}} Cluster The middle, in pixels. */

/**
 * Join each mark of several robots with the robots and marks that it would cover.
 *
 * @param {Cluster[]} clusters Changed.
 * @returns {boolean} Whether some were joined.
 */
function joinMarks(clusters) {
  const before = clusters.length;
  for (let i = 0; i < clusters.length; i++) {
    for (let j = clusters.length - 1; j > i; j--) {
      const [one, other] = [clusters[i], clusters[j]];
      if (one.members.length + other.members.length === 2) continue;
      if (!isNear(one, other, COVERED)) continue;
      join(one, other);
      clusters.splice(j, 1);
    }
  }
  return clusters.length < before;
}

/**
 * @param {Cluster} one Changed.
 * @param {Cluster} other
 */
function join(one, other) {
  const [n, m] = [one.members.length, other.members.length];
  one.x = (n * one.x + m * other.x) / (n + m);
  one.y = (n * one.y + m * other.y) / (n + m);
  one.members.push(...other.members);
}

/**
 * @param {{x: number, y: number}} one
 * @param {{x: number, y: number}} other
 * @param {number} reach
 */
function isNear(one, other, reach) {
  return Math.hypot(one.x - other.x, one.y - other.y) < reach;
}

/**
 * A robot on the map.
 *
 * @typedef {object} Drawn
 * @property {Element} element
 * @property {string} id
 * @property {number} x Metres.
 * @property {number} y
 * @property {number} rank The place of its state among all; 0 is the worst.
 * @property {string} words The words of its state; empty if it needs no one.
 */

/** @type {readonly string[]} The states, the worst first. */
const STATES = Object.keys(WORDS);

/**
 * Keep the robots' names from covering one another, and mark robots that overlap.
 *
 * @param {MapCanvas} map
 * @returns {() => void} Ends the updates.
 */
export function markRobots(map) {
  const marks = new ClusterMarks(map);
  const update = () => {
    const elements = [...map.world.querySelectorAll(".robot:not(.unplaced)")];
    const robots = elements.map((element) => drawn(map, element));
    const places = robots.map(({ id, x, y }) => {
      const place = map.toScreen(x, y);
      return { x: place.x / marks.wall, y: place.y / marks.wall, alone: id === map.selected };
    });
    const far = scaleOf(map.view) < TRUE_SIZE;
    const clusters = far ? clustersOf(places) : [];
    const joined = new Set(clusters.flat());
    robots.forEach(({ element }, index) => {
      if (turn(element, "clustered", joined.has(index))) map.crowd.changed(element);
    });
    map.crowd.settle();
    marks.show(clusters.map((cluster) => cluster.map((index) => robots[index])));
    showNames(map, robots, places, joined);
  };
  // Each reading makes the browser compute styles; only another window changes them.
  const read = () => {
    marks.wall = wallOf();
  };
  addEventListener("resize", read);
  // With the other modules, before the next painting.
  const first = requestAnimationFrame(() => {
    read();
    update();
  });
  return endOf(
    () => removeEventListener("resize", read),
    () => cancelAnimationFrame(first),
    onBeat(update),
    map.onSelect(update),
    map.onView(() => marks.place()),
    () => marks.remove(),
  );
}

/** @returns {number} How much larger than on a desk the marks are: the CSS has `--wall`. */
function wallOf() {
  return Number(getComputedStyle(document.documentElement).getPropertyValue("--wall")) || 1;
}

/**
 * @param {MapCanvas} map
 * @param {Drawn[]} robots
 * @param {{x: number, y: number}[]} places
 * @param {Set<number>} joined Robots without a name of their own.
 */
function showNames({ selected }, robots, places, joined) {
  const alone = robots.map((_, index) => index).filter((index) => !joined.has(index));
  const worded = worst(robots, alone);
  const few = robots.length <= MOST;
  const asked = alone.filter((index) => {
    return few || worded.has(index) || robots[index].id === selected;
  });
  const names = asked.map((index) => {
    return nameOf(robots[index], places[index], selected, worded.has(index));
  });
  const shown = new Set();
  roomFor(names).forEach((room, at) => {
    if (room) shown.add(asked[at]);
  });
  robots.forEach(({ element, id, words }, index) => {
    turn(element, "nameless", !shown.has(index));
    turn(element, "wordless", words !== "" && !worded.has(index) && id !== selected);
  });
}

/**
 * @param {Drawn[]} robots
 * @param {number[]} indices
 * @returns {Set<number>} The worst of those that need someone, which have words.
 */
export function worst(robots, indices) {
  const needed = indices.filter((index) => robots[index].words !== "");
  needed.sort((one, other) => robots[one].rank - robots[other].rank || one - other);
  return new Set(needed.slice(0, WORST));
}

/**
 * @param {Drawn} robot
 * @param {{x: number, y: number}} place
 * @param {string | null} selected
 * @param {boolean} worded Whether it has its words.
 * @returns {Name}
 */
function nameOf({ element, id, rank, words }, { x, y }, selected, worded) {
  const label = element.querySelector(".label")?.textContent ?? "";
  const texts = [label, worded || id === selected ? words : ""];
  const lines = texts[1] ? 2 : 1;
  return {
    x,
    y: y + BELOW + ((lines - 1) * LINE) / 2,
    width: Math.max(...texts.map(({ length }) => length)) * LETTER,
    height: lines * LINE,
    first: id === selected,
    rank,
  };
}

/**
 * @param {MapCanvas} map
 * @param {Element} element
 * @returns {Drawn}
 */
function drawn({ crowd }, element) {
  const { x, y } = crowd.placeOf(element) ?? { x: 0, y: 0 };
  const id = element.getAttribute("data-robot") ?? "";
  const place = STATES.indexOf(element.getAttribute("data-state") ?? "");
  const words = element.querySelector(".words")?.textContent ?? "";
  return { element, id, x, y, rank: place < 0 ? STATES.length : place, words };
}

/**
 * @param {Element} element
 * @param {string} name
 * @param {boolean} on
 * @returns {boolean} Whether that is new.
 */
function turn(element, name, on) {
  const before = element.classList.contains(name);
  if (before !== on) element.classList.toggle(name, on);
  return before !== on;
}

/** The marks of robots that overlap: a number, and the worst of their states. */
class ClusterMarks {
  /** @param {MapCanvas} map */
  constructor(map) {
    this._map = map;
    /** How much larger than on a desk they are. */
    this.wall = 1;
    this._group = svg("g", { class: "clusters" });
    /** @type {Map<string, {element: SVGGElement, robots: Drawn[]}>} By the first robot. */
    this._marks = new Map();
  }

  /** @param {Drawn[][]} clusters */
  show(clusters) {
    if (!this._group.isConnected) this._map.overlay.append(this._group);
    const keys = new Set(clusters.map(([first]) => first.id));
    forgetOthers(this._marks, keys, ({ element }) => element.remove());
    for (const robots of clusters) {
      const key = robots[0].id;
      // The element stays, so that a press on it does not miss.
      const element = this._marks.get(key)?.element ?? this._mark(key);
      this._marks.set(key, { element, robots });
      fill(element, robots);
    }
    this.place();
  }

  /** Place the marks in the view of now. */
  place() {
    for (const { element, robots } of this._marks.values()) {
      const [x, y] = middle(robots);
      const place = this._map.toScreen(x, y);
      const size = this.wall === 1 ? "" : ` scale(${this.wall})`;
      element.setAttribute("transform", `translate(${place.x} ${place.y})${size}`);
    }
  }

  remove() {
    this._group.remove();
  }

  /** @param {string} key */
  _mark(key) {
    const use = svg("use", { x: "-8", y: "-8", width: "16", height: "16" });
    const badge = svg("g", { class: "state-mark" }, svg("circle", { r: "11" }), use);
    const count = svg("text", { class: "count" });
    const title = svg("title", {});
    const circle = svg("circle", { class: "disc", r: `${RADIUS}` });
    const attributes = { class: "cluster", role: "button", tabindex: "0" };
    const mark = svg("g", attributes, title, circle, count, badge);
    const zoom = (/** @type {Event} */ event) => {
      event.stopPropagation();
      const robots = this._marks.get(key)?.robots;
      if (robots) zoomTo(this._map, robots);
    };
    mark.addEventListener("click", zoom);
    mark.addEventListener("keydown", (event) => {
      if (event.key === "Enter") zoom(event);
    });
    this._group.append(mark);
    return mark;
  }
}

/**
 * @param {SVGGElement} mark
 * @param {Drawn[]} robots
 */
function fill(mark, robots) {
  const first = robots.reduce((one, other) => (other.rank < one.rank ? other : one)).element;
  const words = first.getAttribute("data-group") ?? "";
  const needed = robots.filter((each) => each.words !== "").length;
  const needs = needed === 0 ? "" : `, ${needed} ${needed === 1 ? "needs" : "need"} someone`;
  const symbol = first.querySelector(".state-mark > use")?.getAttribute("href");
  const label = `${robots.length} robots${needs}, the worst: ${words}. Press to zoom in`;
  if (symbol) mark.querySelector("use")?.setAttribute("href", symbol);
  mark.classList.toggle("idle", words === "free");
  mark.dataset.tone = first.getAttribute("data-tone") ?? "";
  if (mark.getAttribute("aria-label") === label) return;
  mark.setAttribute("aria-label", label);
  for (const [path, text] of [["title", label], [".count", `${robots.length}`]]) {
    const element = mark.querySelector(path);
    if (element) element.textContent = text;
  }
}

/**
 * @param {Drawn[]} robots
 * @returns {[number, number]} The middle of all, in metres.
 */
function middle(robots) {
  const sum = robots.reduce(([x, y], robot) => [x + robot.x, y + robot.y], [0, 0]);
  return [sum[0] / robots.length, sum[1] / robots.length];
}

/**
 * Show robots so large that they do not overlap, in the middle of the map.
 *
 * @param {MapCanvas} map
 * @param {Drawn[]} robots
 */
function zoomTo(map, robots) {
  const [x, y] = middle(robots);
  const reach = Math.max(...robots.map((each) => Math.hypot(each.x - x, each.y - y)));
  const room = (FILLED * Math.min(map.width, map.height)) / 2;
  const scale = scaleOf(map.view);
  const factor = Math.min(Math.max(room / reach, 2 * scale), TRUE_SIZE) / scale;
  const at = map.toScreen(x, y);
  const there = translate(map.view, map.width / 2 - at.x, map.height / 2 - at.y);
  map.setView(scaled(there, factor, map.width / 2, map.height / 2));
}
