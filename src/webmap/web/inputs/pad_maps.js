/** What each axis and button of a gamepad does, how it is called, and where it is kept. */

import { DEAD_ZONE, axesOfStick, beyondDeadZone } from "./sticks.js";

/** @typedef {import('../motion/inputs.js').Axes} Axes */

/**
 * The parts of the browser's `Gamepad` that are read.
 *
 * @typedef {object} Pad
 * @property {number} index
 * @property {string} id
 * @property {boolean} connected
 * @property {string} mapping
 * @property {number} timestamp
 * @property {readonly number[]} axes
 * @property {readonly {pressed: boolean}[]} buttons
 */

/** @typedef {"ahead" | "side" | "spin"} AxisAction */
/** @typedef {"hold" | "stop"} ButtonAction */

/**
 * An axis, and the sign of its values for forward or left, 1 or -1.
 *
 * @typedef {{axis: number, sign: number}} Way
 */

/**
 * @typedef {object} PadMap
 * @property {Way | null} ahead Drives forward.
 * @property {Way | null} side Turns to the left; moves a holonomic base to the left.
 * @property {Way | null} spin Turns a holonomic base to the left.
 * @property {number | null} hold The dead-man button, which must be held to drive.
 * @property {number | null} stop The button that is STOP.
 * @property {number} zone The dead zone.
 */

/** @type {readonly AxisAction[]} */
const AXES = ["ahead", "side", "spin"];

/** The smallest and the greatest dead zone. */
export const ZONES = { least: 0.02, most: 0.4 };

/**
 * Of the standard mapping: LB or L1 is the dead-man button, B or Circle is STOP.
 *
 * @type {Readonly<PadMap>}
 */
export const STANDARD = Object.freeze({
  ahead: { axis: 1, sign: -1 },
  side: { axis: 0, sign: -1 },
  spin: { axis: 2, sign: -1 },
  hold: 4,
  stop: 1,
  zone: DEAD_ZONE,
});

/** Of a gamepad whose buttons are not known. @type {Readonly<PadMap>} */
const UNKNOWN = Object.freeze({
  ...{ ahead: null, side: null, spin: null, hold: null, stop: null },
  zone: DEAD_ZONE,
});

/** @param {PadMap} map Whether a gamepad with it can drive and stop a robot. */
export function isComplete({ ahead, side, hold, stop }) {
  return ahead !== null && side !== null && hold !== null && stop !== null;
}

/**
 * The left stick drives and turns. For a holonomic base the left stick drives in all
 * directions, and the right stick turns.
 *
 * @param {Pad} pad
 * @param {PadMap} map
 * @param {boolean} holonomic
 * @returns {Axes}
 */
export function axesOfPad({ axes }, { ahead, side, spin, zone }, holonomic) {
  const value = (/** @type {Way | null} */ way) =>
    way ? way.sign * (axes[way.axis] ?? 0) : 0;
  const moved = axesOfStick(-value(side), -value(ahead), { sideways: holonomic, zone });
  return holonomic ? { ...moved, turn: beyondDeadZone(value(spin), zone) } : moved;
}

/**
 * Assign an axis or a button to an action. An action that had it gets what this action
 * had; STOP never loses its button to another action.
 *
 * @param {PadMap} map
 * @param {AxisAction | ButtonAction} action
 * @param {Way | number} found
 * @returns {PadMap | null} null if it is the button of STOP.
 */
export function assign(map, action, found) {
  if (typeof found === "number") {
    if (action === "stop") {
      return { ...map, hold: found === map.hold ? map.stop : map.hold, stop: found };
    }
    return found === map.stop ? null : { ...map, [action]: found };
  }
  const other = AXES.find((each) => each !== action && map[each]?.axis === found.axis);
  const freed = other ? { [other]: map[/** @type {AxisAction} */ (action)] } : {};
  return { ...map, ...freed, [action]: found };
}

/** Values of an axis that rests, at most, and of one that is pushed, at least. */
const REST = 0.3;
const PUSH = 0.6;
/** An axis that rests has these values for so long, in ms: a trigger only passes them. */
const RESTS = 300;

/**
 * Finds the button that is pressed, or the axis that is pushed and rests again in its
 * middle: a trigger would drive at rest. Times are in milliseconds of one clock.
 */
export class Finder {
  /** @param {"axis" | "button"} kind */
  constructor(kind) {
    this._kind = kind;
    /** The buttons that were released, or the axes that were in the middle. */
    this._free = new Set();
    /** @type {Way | null} */
    this._pushed = null;
    this._restsSince = Infinity;
  }

  /**
   * @param {Pad} pad
   * @param {number} now
   * @returns {Way | number | null} null while nothing is found.
   */
  read({ axes, buttons }, now) {
    return this._kind === "axis" ? this._axis(axes, now) : this._button(buttons);
  }

  /** @param {Pad["buttons"]} buttons */
  _button(buttons) {
    const found = buttons.findIndex(({ pressed }, i) => pressed && this._free.has(i));
    buttons.forEach(({ pressed }, i) => !pressed && this._free.add(i));
    return found < 0 ? null : found;
  }

  /**
   * @param {readonly number[]} axes
   * @param {number} now
   */
  _axis(axes, now) {
    if (this._pushed === null) {
      const axis = axes.findIndex((value, i) => Math.abs(value) > PUSH && this._free.has(i));
      axes.forEach((value, i) => Math.abs(value) < REST && this._free.add(i));
      if (axis >= 0) this._pushed = { axis, sign: Math.sign(axes[axis]) };
      return null;
    }
    const rests = Math.abs(axes[this._pushed.axis] ?? 1) < REST;
    this._restsSince = rests ? Math.min(this._restsSince, now) : Infinity;
    return now - this._restsSince >= RESTS ? this._pushed : null;
  }
}

// Names ------------------------------------------------------------------------

const PARTS = [
  ...["left stick press", "right stick press"],
  ...["D-pad up", "D-pad down", "D-pad left", "D-pad right", "Home"],
];
const XBOX = ["A", "B", "X", "Y", "LB", "RB", "LT", "RT", "View", "Menu", ...PARTS];
const SONY = ["Cross", "Circle", "Square", "Triangle", "L1", "R1", "L2", "R2"];
const SONY_ALL = [...SONY, "Create", "Options", ...PARTS];

/** @param {Pad} pad Its name without the numbers that browsers add. */
export function nameOf({ id }) {
  const name = id.replace(/^[0-9a-f]{1,4}-[0-9a-f]{1,4}-/i, "");
  return (name.replace(/ *\([^(]*Vendor:.*$/, "") || id).slice(0, 80);
}

/**
 * @param {Pad} pad
 * @param {number | null} button
 */
export function buttonName({ id, mapping }, button) {
  if (button === null) return "not assigned";
  const sony = /054c|sony|playstation|dualshock|dualsense/i.test(id);
  const known = mapping === "standard" ? (sony ? SONY_ALL : XBOX) : [];
  return known[button] ?? `button ${button + 1}`;
}

/**
 * @param {Pad} pad
 * @param {Way | null} way
 */
export function axisName({ mapping }, way) {
  if (way === null) return "not assigned";
  if (mapping !== "standard" || way.axis > 3) return `axis ${way.axis + 1}`;
  const which = way.axis % 2 ? "up, down" : "left, right";
  return `${way.axis < 2 ? "left" : "right"} stick ${which}`;
}

/**
 * @param {Pad} pad
 * @param {PadMap} map
 * @param {string} [joint] Between what is held and what is moved.
 * @returns {string} What is held and moved to drive.
 */
export function controlsOf(pad, map, joint = " and ") {
  const [ahead, side] = [axisName(pad, map.ahead), axisName(pad, map.side)];
  const [stick] = ahead.split(/ (?:up|left), /, 1);
  const one = stick !== ahead && side.startsWith(stick);
  const moved = one ? `the ${stick}` : [...new Set([ahead, side])].join(" and ");
  return buttonName(pad, map.hold) + joint + moved;
}

// What is kept -------------------------------------------------------------------

/** The key of the assignments in this browser's storage. */
const KEPT = "webmap.gamepads";

/** The most gamepads that are kept. */
const MOST = 20;

/** The assignments of the gamepads, by the `id` of each. */
export class PadMaps {
  constructor() {
    this._kept = readKept();
  }

  /**
   * @param {Pad} pad
   * @returns {PadMap} The same object until it is changed.
   */
  of({ id, mapping }) {
    const kept = this._kept.get(id);
    if (mapping !== "standard") return kept ?? UNKNOWN;
    return kept && isComplete(kept) ? kept : STANDARD;
  }

  /**
   * @param {Pad} pad
   * @param {PadMap} map
   */
  keep({ id }, map) {
    this._kept.delete(id);
    this._kept.set(id, map);
    try {
      localStorage.setItem(KEPT, JSON.stringify([...this._kept].slice(-MOST)));
    } catch {
      // A browser without storage, or whose storage is full, forgets it with the page.
    }
  }

  /** @param {Pad} pad Of one without the standard mapping, STOP keeps its button. */
  restore(pad) {
    const { stop } = this.of(pad);
    this.keep(pad, pad.mapping === "standard" ? STANDARD : { ...UNKNOWN, stop });
  }
}

/** @returns {Map<string, PadMap>} */
function readKept() {
  try {
    /** @type {[string, PadMap][]} */
    const entries = JSON.parse(localStorage.getItem(KEPT) ?? "[]");
    return new Map(entries.map(([id, map]) => [String(id), checked(map)]));
  } catch {
    return new Map();
  }
}

/**
 * @param {PadMap} map As it was kept.
 * @returns {PadMap} Without values that are not valid.
 */
function checked({ ahead, side, spin, hold, stop, zone }) {
  const way = (/** @type {Way | null} */ kept) =>
    kept && isIndex(kept.axis) && Math.abs(kept.sign) === 1 ? kept : null;
  const sound = zone >= ZONES.least && zone <= ZONES.most;
  return {
    ...{ ahead: way(ahead), side: way(side), spin: way(spin) },
    hold: isIndex(hold) && hold !== stop ? hold : null,
    stop: isIndex(stop) ? stop : null,
    zone: sound ? zone : DEAD_ZONE,
  };
}

/** @param {unknown} value */
function isIndex(value) {
  return Number.isInteger(value) && Number(value) >= 0;
}
