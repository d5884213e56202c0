import { LEVELS } from "./constants.js";
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
 * What an operator's layout of a page is: what is seen of the map, what is switched on,
 * which panels are open and where the camera is. Nothing of it concerns a robot: no
 * selection, no lease, no goal; a file that has more than this is refused.
 *
 * @typedef {object} Place
 * @property {number} x What is in the middle of the map, in metres.
 * @property {number} y
 * @property {number} pixels_per_metre
 * @property {number} turn_rad How far the map is turned, counter-clockwise.
 *
 * @typedef {{open: boolean, shown: Record<string, boolean>}} Layers
 * @typedef {{open: boolean, least: string}} Log
 * @typedef {{dock: 'side' | 'below' | 'float', x: number, y: number}} Camera
 *
 * @typedef {object} Layout A part that is not there is left as it is.
 * @property {Place} [view]
 * @property {Layers} [layers]
 * @property {Log} [log]
 * @property {Camera} [camera]
 */

/** What this program writes, and the only one that it reads. */
export const VERSION = 1;

/** Bytes of a file, at the most. */
export const MOST_BYTES = 64 * 1024;

/** Characters of a layer's name, and of what was got as a message shows it. */
const LONGEST_NAME = 300;
const LONGEST_GOT = 40;

/** @typedef {(value: unknown, path: string) => any} Check Throws if it is not right. */

/** Why a layout was not taken: what was got, what was expected, what to do. */
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
 * @param {Record<string, Check>} parts All of which must be there.
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

/** @type {Record<keyof Layout, Check>} */
const PARTS = {
  view: checkedPlace,
  layers: whole({ open: truth, shown: switches }),
  log: whole({ open: truth, least: oneOf([...LEVELS]) }),
  camera: whole({
    dock: oneOf(["side", "below", "float"]),
    x: number(0, 1),
    y: number(0, 1),
  }),
};

/**
 * @param {unknown} value What was kept of a view.
 * @returns {Place | null} null if it is none.
 */
export function asPlace(value) {
  try {
    return checkedPlace(value, "view");
  } catch {
    return null;
  }
}

/**
 * @param {number} bytes Of a file, before it is read.
 * @throws {LayoutRefused} If that is more than any layout has.
 */
export function checkSize(bytes) {
  if (bytes <= MOST_BYTES) return;
  const [got, most] = [bytes / 1024, MOST_BYTES / 1024].map((kb) => Math.ceil(kb));
  throw new LayoutRefused(
    `The file is too large: expected at most ${most} kB, got ${got} kB. Is it a layout?`,
  );
}

/**
 * Read the text of a file, strictly: all of it is right, or nothing is taken.
 *
 * @param {string} text
 * @returns {Layout}
 * @throws {LayoutRefused} With a sentence for the one who chose the file.
 */
export function readLayout(text) {
  checkSize(new TextEncoder().encode(text).length);
  const given = table(parsed(text), "The file");
  const { version, ...parts } = given;
  if (version === undefined) {
    throw new LayoutRefused(
      `The file is no layout: expected "version": ${VERSION}, got none. Choose a file that Save made.`,
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
      `The file is no layout: expected JSON, got ${start}. Choose a file that Save made.`,
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

/** How much of its size a view may be skewed by rounding. */
const ROUNDING = 1e-6;

/**
 * Say what is seen without saying on how large a screen.
 *
 * @param {Matrix} view
 * @param {Size} size
 * @returns {Place | null} null if the view is skewed or mirrored, which no hand does.
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
 * @returns {Matrix} The view with that place in its middle.
 */
export function viewOf({ x, y, pixels_per_metre: k, turn_rad }, { width, height }) {
  const [across, down] = [width / 2, height / 2];
  const straight = { ...initialView(width, height), a: k, d: -k };
  const there = translate(straight, -k * x, k * y);
  return rotate(there, (turn_rad * 180) / Math.PI, across, down);
}

/**
 * What one module of a page adds to a layout.
 *
 * @template T
 * @typedef {object} Part
 * @property {() => T} read
 * @property {(value: T) => void} write Takes what was read from a file, and checked.
 * @property {() => void} reset Makes it as it was found.
 */

/** @typedef {Exclude<keyof Layout, 'view'>} Name */

/** The parts of a map's layout, each from the module that has it, if that is there. */
export class LayoutParts {
  constructor() {
    /** @type {Map<Name, Part<any>>} */
    this._parts = new Map();
  }

  /**
   * @template {Name} K
   * @param {K} name
   * @param {Part<Required<Layout>[K]>} part
   * @returns {() => void} Takes it away.
   */
  add(name, part) {
    this._parts.set(name, part);
    return () => {
      if (this._parts.get(name) === part) this._parts.delete(name);
    };
  }

  /** @returns {Layout} How everything is. */
  read() {
    return Object.fromEntries([...this._parts].map(([name, part]) => [name, part.read()]));
  }

  /** @param {Layout} layout What of it this page has is taken. */
  write(layout) {
    for (const [name, part] of this._parts) {
      if (layout[name] !== undefined) part.write(layout[name]);
    }
  }

  /** Make everything as it was found. */
  reset() {
    for (const part of this._parts.values()) part.reset();
  }
}

/** Where the last views are kept in this browser. */
const KEPT = "webmap.views";

/** Addresses whose view is kept, at the most; the one that was seen longest ago goes. */
const MOST = 32;

/**
 * @param {string} address
 * @returns {Place | null} How that page was seen last; null if that is not known.
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
  try {
    localStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(entries.slice(-MOST))));
  } catch {
    // Without storage the page begins as it was found.
  }
}

/** @returns {Record<string, unknown>} */
function all() {
  try {
    const value = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    return typeof value === "object" && value !== null && !Array.isArray(value) ? value : {};
  } catch {
    return {}; // storage may be forbidden, or hold what is not ours
  }
}
