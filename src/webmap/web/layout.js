import { LEVELS } from "./constants.js";
import { readStored, store } from "./stored.js";
import {
  initialView,
  LARGEST,
  rotate,
  scaleOf,
  SMALLEST,
  translate,
  unapply,
} from "./view.js";

/** @typedef {import('./view.js').Matrix} Matrix */

/**
 * An operator's layout of a page: the visible part of the map, the layers that are
 * switched on, the open panels and the place of the camera. It has nothing about a
 * robot: no selection, no control, no goal; a file with more than this is refused.
 *
 * @typedef {object} Place
 * @property {number} x The middle of the map, in metres.
 * @property {number} y
 * @property {number} pixels_per_metre
 * @property {number} turn_rad Rotation of the map, counter-clockwise.
 *
 * @typedef {{open: boolean, shown: Record<string, boolean>}} Layers
 * @typedef {{open: boolean, least: string}} Log
 * @typedef {{open: boolean, width: number, more: boolean}} Panel Width in pixels; whether
 *     the card shows more.
 * @typedef {{dock: 'side' | 'below' | 'float', x: number, y: number}} Camera
 *
 * @typedef {object} List The list of robots.
 * @property {'auto' | 'state' | 'name' | 'battery' | 'added'} order `auto`: the worst
 *     first in a long list, else as added.
 * @property {'none' | 'bridge' | 'tag'} group
 * @property {'usual' | 'compact'} rows
 * @property {string[]} states Only robots in these groups of states are shown; all if
 *     it is empty.
 *
 * @typedef {object} Layout A missing part is left unchanged.
 * @property {Place} [view]
 * @property {Layers} [layers]
 * @property {Log} [log]
 * @property {Panel} [panel]
 * @property {Camera} [camera]
 * @property {List} [list]
 */

/** The version that this program writes, and the only one that it reads. */
export const VERSION = 1;

/** Most bytes of a file. */
export const MOST_BYTES = 64 * 1024;

/** Most characters of a layer's name, and of a wrong value in an error message. */
const LONGEST_NAME = 300;
const LONGEST_GOT = 40;

/** @typedef {(value: unknown, path: string) => any} Check Throws if it is invalid. */

/** Why a layout was refused: the value, the expected value, what to do. */
export class LayoutRefused extends Error {}

/**
 * @param {string} path
 * @param {string} expected
 * @param {unknown} got
 */
function refuse(path, expected, got) {
  return new LayoutRefused(`${path}: expected ${expected}, got ${shown(got)}.`);
}

/** @param {unknown} got */
function shown(got) {
  if (got === undefined) return "nothing";
  if (Array.isArray(got)) return "a list";
  if (typeof got === "object" && got !== null) return "a table";
  const text = JSON.stringify(got);
  return text.length > LONGEST_GOT ? `${text.slice(0, LONGEST_GOT)}…` : text;
}

/**
 * @param {number} least
 * @param {number} most
 * @returns {Check}
 */
function number(least, most) {
  return (value, path) => {
    if (typeof value === "number" && value >= least && value <= most) return value;
    throw refuse(path, `a number from ${least} to ${most}`, value);
  };
}

/** @type {Check} */
const truth = (value, path) => {
  if (typeof value === "boolean") return value;
  throw refuse(path, "true or false", value);
};

/**
 * @param {readonly string[]} words
 * @returns {Check}
 */
function oneOf(words) {
  return (value, path) => {
    if (words.some((word) => word === value)) return value;
    throw refuse(path, words.map((word) => JSON.stringify(word)).join(", "), value);
  };
}

/**
 * @param {unknown} value
 * @param {string} path
 * @returns {Record<string, unknown>}
 */
function table(value, path) {
  if (typeof value === "object" && value !== null && !Array.isArray(value)) {
    return /** @type {Record<string, unknown>} */ (value);
  }
  throw refuse(path, "a table", value);
}

/**
 * @param {Record<string, Check>} parts All are required.
 * @returns {Check}
 */
function whole(parts) {
  return (value, path) => {
    const given = table(value, path);
    known(given, Object.keys(parts), path);
    return Object.fromEntries(
      Object.entries(parts).map(([key, check]) => [key, check(given[key], `${path}.${key}`)]),
    );
  };
}

/**
 * @param {Record<string, unknown>} given
 * @param {string[]} keys
 * @param {string} path
 */
function known(given, keys, path) {
  const other = Object.keys(given).find((key) => !keys.includes(key));
  if (other === undefined) return;
  throw new LayoutRefused(`${path}: has ${shown(other)}, expected only ${keys.join(", ")}.`);
}

/** @type {Check} */
const switches = (value, path) => {
  const given = table(value, path);
  for (const [name, on] of Object.entries(given)) {
    if (name.length > LONGEST_NAME) {
      throw refuse(path, `names of ${LONGEST_NAME} characters at most`, name);
    }
    truth(on, `${path}[${shown(name)}]`);
  }
  return { ...given };
};

const FAR = 1e9;

const checkedPlace = whole({
  x: number(-FAR, FAR),
  y: number(-FAR, FAR),
  pixels_per_metre: number(SMALLEST, LARGEST),
  turn_rad: number(-7, 7),
});

/** Most groups of states that the list of robots is filtered by. */
const MOST_STATES = 30;

/** @type {Check} */
const states = (value, path) => {
  const each = Array.isArray(value) ? value : [null];
  const valid = each.every((one) => typeof one === "string" && one.length <= LONGEST_NAME);
  if (valid && each.length <= MOST_STATES) return [...each];
  throw refuse(path, `a list of ${MOST_STATES} texts at most`, value);
};

export const checkedList = whole({
  order: oneOf(["auto", "state", "name", "battery", "added"]),
  group: oneOf(["none", "bridge", "tag"]),
  rows: oneOf(["usual", "compact"]),
  states,
});

/** @type {Record<keyof Layout, Check>} */
const PARTS = {
  view: checkedPlace,
  layers: whole({ open: truth, shown: switches }),
  log: whole({ open: truth, least: oneOf([...LEVELS]) }),
  panel: whole({ open: truth, width: number(0, 10_000), more: truth }),
  camera: whole({
    dock: oneOf(["side", "below", "float"]),
    x: number(0, 1),
    y: number(0, 1),
  }),
  list: checkedList,
};

/**
 * @param {unknown} value A stored view.
 * @returns {Place | null} null if it is invalid.
 */
export function asPlace(value) {
  try {
    return checkedPlace(value, "view");
  } catch {
    return null;
  }
}

/**
 * @param {number} bytes Size of a file, before it is read.
 * @throws {LayoutRefused} If the file is too large for a layout.
 */
export function checkSize(bytes) {
  if (bytes <= MOST_BYTES) return;
  const [got, most] = [bytes / 1024, MOST_BYTES / 1024].map((kb) => Math.ceil(kb));
  throw new LayoutRefused(
    `The file is too large: expected at most ${most} kB, got ${got} kB. Is it a layout?`,
  );
}

/**
 * Read the text of a file, strictly: if any part is invalid, all of it is refused.
 *
 * @param {string} text
 * @returns {Layout}
 * @throws {LayoutRefused} With a sentence for the person who chose the file.
 */
export function readLayout(text) {
  checkSize(new TextEncoder().encode(text).length);
  const given = table(parsed(text), "The file");
  const { version, ...parts } = given;
  if (version === undefined) {
    throw new LayoutRefused(
      `Not a layout file: expected "version": ${VERSION}, got none. Choose a file that Save made.`,
    );
  }
  if (version !== VERSION) {
    throw new LayoutRefused(
      `The layout is of another version: expected ${VERSION}, got ${shown(version)}. ` +
        "Save the layout again with this version of WebMap.",
    );
  }
  const names = /** @type {(keyof Layout)[]} */ (Object.keys(PARTS));
  known(parts, names, "The layout");
  /** @type {Layout} */
  const layout = {};
  for (const name of names) {
    if (parts[name] !== undefined) layout[name] = PARTS[name](parts[name], name);
  }
  return layout;
}

/**
 * @param {string} text
 * @returns {unknown}
 */
function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    const start = text.trim() === "" ? "an empty file" : shown(text.trim());
    throw new LayoutRefused(
      `Not a layout file: expected JSON, got ${start}. Choose a file that Save made.`,
    );
  }
}

/**
 * @param {Layout} layout
 * @returns {string} The text of its file.
 */
export function writeLayout(layout) {
  return `${JSON.stringify({ version: VERSION, ...layout }, null, 2)}\n`;
}

/** @typedef {{width: number, height: number}} Size Pixels. */

/** Greatest skew of a view by rounding, relative to its size. */
const ROUNDING = 1e-6;

/**
 * Describe the visible part of the map independently of the screen size.
 *
 * @param {Matrix} view
 * @param {Size} size
 * @returns {Place | null} null if the view is skewed or mirrored, which no viewer does.
 */
export function placeOf(view, { width, height }) {
  const scale = scaleOf(view);
  const skewed = Math.max(Math.abs(view.a + view.d), Math.abs(view.b - view.c));
  if (!(skewed <= ROUNDING * scale)) return null;
  const { x, y } = unapply(view, width / 2, height / 2);
  return { x, y, pixels_per_metre: scale, turn_rad: Math.atan2(-view.b, view.a) };
}

/**
 * @param {Place} place
 * @param {Size} size
 * @returns {Matrix} The view with that place in the middle.
 */
export function viewOf({ x, y, pixels_per_metre: k, turn_rad }, { width, height }) {
  const [across, down] = [width / 2, height / 2];
  const straight = { ...initialView(width, height), a: k, d: -k };
  const there = translate(straight, -k * x, k * y);
  return rotate(there, (turn_rad * 180) / Math.PI, across, down);
}

/** Key of the last views in this browser's storage. */
const KEPT = "webmap.views";

/** Most addresses with a stored view; beyond it the oldest is dropped. */
const MOST = 32;

/**
 * @param {string} address
 * @returns {Place | null} The last view of that page; null if unknown.
 */
export function keptView(address) {
  const views = all();
  return Object.hasOwn(views, address) ? asPlace(views[address]) : null;
}

/**
 * @param {string} address
 * @param {Place | null} place null to forget it.
 */
export function keepView(address, place) {
  const entries = Object.entries(all()).filter(([other]) => other !== address);
  if (place) entries.push([address, place]);
  store(KEPT, Object.fromEntries(entries.slice(-MOST)));
}

/** @returns {Record<string, unknown>} */
function all() {
  const value = readStored(KEPT);
  return typeof value === "object" && value !== null && !Array.isArray(value) ? value : {};
}
