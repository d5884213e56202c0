import { LARGEST, SMALLEST } from "./view.js";

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

const view = whole({
  x: number(-FAR, FAR),
  y: number(-FAR, FAR),
  pixels_per_metre: number(SMALLEST, LARGEST),
  turn_rad: number(-7, 7),
});

/** @type {Record<keyof Layout, Check>} */
const PARTS = {
  view,
  layers: whole({ open: truth, shown: switches }),
  log: whole({ open: truth, least: oneOf(["debug", "info", "warn", "error", "fatal"]) }),
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
    return view(value, "view");
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
        "Save it anew with this program.",
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
