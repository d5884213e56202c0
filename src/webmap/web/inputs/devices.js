/**
 * The input devices of a page, and the map that they belong to.
 *
 * This folder reads keys, gamepads and the on-screen stick. Open this file first. Whether
 * the inputs move a robot is decided in `../motion`.
 */

import { attentive, takesKeys, takesText } from "./focus.js";
import { Gamepads } from "./gamepads.js";
import { Keys } from "./keys.js";
import { PadMaps } from "./pad_maps.js";

/** @typedef {import('../drive.js').Drive} Drive */
/** @typedef {import('./keys.js').StopKey} StopKey */

/**
 * A map that robots can be driven from.
 *
 * @typedef {object} DrivingMap
 * @property {object} map
 * @property {() => string | null} robot The robot that is selected there.
 * @property {boolean} holonomic Whether its inputs also move a base sideways.
 * @property {(active: boolean) => void} onActive Called when this map gets or loses the
 *     page's inputs.
 */

/** @type {WeakMap<Drive, Devices>} */
const known = new WeakMap();

/**
 * Return the input devices of a page. The first call makes them.
 *
 * @param {Drive} drive
 */
export function devicesOf(drive) {
  const devices = known.get(drive) ?? new Devices(drive);
  known.set(drive, devices);
  return devices;
}

/**
 * The keyboard and the gamepads, which all maps of a page share.
 *
 * They drive the robot that is selected on the map that the operator used last, so that two
 * maps of a page never drive at the same time.
 */
export class Devices {
  /** @param {Drive} drive */
  constructor(drive) {
    this._drive = drive;
    /** @type {DrivingMap[]} */
    this._maps = [];
    /** @type {DrivingMap | null} */
    this.active = null;
    /** @type {Set<() => boolean>} */
    this._escapes = new Set();
    /** @type {Set<(event: KeyboardEvent) => boolean>} */
    this._keyUsers = new Set();
    this._uses = 0;
    /** @type {Keys | null} */
    this._keys = null;
    /** @type {Gamepads | null} */
    this._pads = null;
    this.padMaps = new PadMaps();
    /** What opens the settings of gamepads. @type {(() => void) | null} */
    this.padSettings = null;
  }

  /** The gamepads of the page; null while nothing uses them. */
  get pads() {
    return this._pads;
  }

  /** What is held and moved to drive with a gamepad; empty without one. */
  get gamepad() {
    return this._pads?.controls ?? "";
  }

  /** Whether a gamepad's dead-man button is held without effect. */
  get spent() {
    return this._pads?.spent ?? false;
  }

  /** Whether a driving key had no effect because the keyboard reports no positions. */
  get codeless() {
    return this._keys?.codeless ?? false;
  }

  /**
   * Use the STOP keys and the inputs of the page, also if there is no robot to drive.
   *
   * @returns {() => void} Ends the use.
   */
  open() {
    this._uses += 1;
    const owner = {
      wanted: () => this.active?.robot() != null,
      holonomic: () => this.active?.holonomic ?? false,
    };
    this._pads ??= new Gamepads(this._drive, {
      ...owner,
      maps: this.padMaps,
      stopByPad: () => this._stopOne(),
      settings: () => this.padSettings,
    });
    this._keys ??= new Keys(this._drive, {
      ...owner,
      stop: (event, how) => this._stop(event, how),
      used: (event) => this._used(event),
    });
    let ended = false;
    return () => {
      if (ended) return;
      ended = true;
      this._uses -= 1;
      if (this._uses > 0) return;
      this._keys?.destroy();
      this._keys = null;
      this._pads?.destroy();
      this._pads = null;
    };
  }

  /**
   * Add a map to drive from. The first map is active until the operator uses another.
   *
   * @param {DrivingMap} map
   * @returns {() => void} Removes the map.
   */
  addMap(map) {
    const close = this.open();
    this._maps.push(map);
    if (this.active === null) this.activate(map);
    return () => {
      close();
      this._maps = this._maps.filter((other) => other !== map);
      if (this.active === map) this.activate(this._maps[0] ?? null);
    };
  }

  /**
   * Give the inputs to a map.
   *
   * @param {DrivingMap | null} map
   */
  activate(map) {
    if (map === this.active) return;
    this.active?.onActive(false);
    this.active = map;
    this.choose();
    map?.onActive(true);
  }

  /** Choose the robot that is selected on the active map. */
  choose() {
    this._drive.choose(this.active?.robot() ?? null);
  }

  /**
   * Let Escape end a tool or close a menu instead of STOP, unless a robot is driven.
   *
   * @param {() => boolean} leave Ends it; returns whether it was active.
   * @returns {() => void} Removes this use of Escape.
   */
  claimEscape(leave) {
    this._escapes.add(leave);
    return () => {
      this._escapes.delete(leave);
    };
  }

  /**
   * Let a tool use keys that would drive a robot, unless an input is held: a robot that
   * is driven goes on. A STOP key is never used.
   *
   * @param {(event: KeyboardEvent) => boolean} use Returns whether it used the key.
   * @returns {() => void} Removes this use of keys.
   */
  claimKeys(use) {
    this._keyUsers.add(use);
    return () => {
      this._keyUsers.delete(use);
    };
  }

  /**
   * Let a key turn a tool of a map on and off, unless another map is the active one.
   *
   * @param {import('../map.js').MapCanvas} map
   * @param {string} wanted The key; "" for none.
   * @param {() => void} turn
   * @param {AbortSignal} signal
   */
  listenToTool(map, wanted, turn, signal) {
    const pressed = (/** @type {KeyboardEvent} */ event) => {
      if (event.key !== wanted || event.repeat || event.isComposing) return;
      if (event.ctrlKey || event.altKey || event.metaKey || !attentive()) return;
      if (this.active === null || this.active.map === map) turn();
    };
    window.addEventListener("keydown", pressed, { signal });
  }

  /**
   * @param {KeyboardEvent} event
   * @returns {boolean} Whether a tool used the key, which then drives no robot.
   */
  _used(event) {
    if (this._drive.status.pressed) return false;
    return [...this._keyUsers].some((use) => uses(() => use(event)));
  }

  /**
   * @param {KeyboardEvent} event
   * @param {StopKey} how
   */
  _stop({ target, shiftKey }, { escape, byTab }) {
    const { driven, taking, choice } = this._drive.status;
    if (escape && shiftKey) {
      this._drive.stop("*");
      return true;
    }
    if (!escape && takesText(target)) return false;
    if (!escape && byTab && !this._drive.drives && keepsSpace(target)) return false;
    const drives = driven !== null || taking;
    if (!drives && escape) {
      if (keepsEscape(target)) return false;
      const held = choice !== null && this._drive.moves(choice);
      if (!held && uses(closesMenu)) return true;
      for (const leave of this._escapes) if (uses(leave)) return true;
    }
    this._stopOne();
    return true;
  }

  /** Without a robot this stops all: an unnecessary STOP is harmless. */
  _stopOne() {
    const { driven, choice } = this._drive.status;
    this._drive.stop(driven ?? choice ?? "*");
  }
}

/** Inputs that use Escape themselves. */
const TYPED = "input:not([type=checkbox], [type=radio], [type=button], [type=submit])";

/** Menus that Escape closes: elements with the attribute, and popovers. */
const MENUS = "[data-webmap-menu], [popover]:not([popover=manual])";

/**
 * Close an open menu, unless the alarm covers it.
 *
 * @returns {boolean} Whether there was one.
 */
function closesMenu() {
  if (document.querySelector(".webmap-alarm")) return false;
  /** @type {NodeListOf<HTMLElement>} */
  const found = document.querySelectorAll(MENUS);
  const open = [...found].filter((one) => one.matches("[open], :popover-open"));
  const menu = open.find(isShown);
  if (!menu) return false;
  const inside = menu.contains(document.activeElement);
  if (menu instanceof HTMLDialogElement) menu.close();
  else if (menu instanceof HTMLDetailsElement) menu.open = false;
  else menu.hidePopover();
  // With the focus on a summary, Space would open it and not be STOP.
  const map = /** @type {SVGElement | null} */ (document.querySelector("svg.webmap"));
  if (inside) map?.focus();
  return true;
}

/**
 * @param {Element} menu
 * @returns {boolean} Whether a part of the menu is on the page; the menu itself has no
 *     box where its parts are laid out one by one (`display: contents`).
 */
function isShown(menu) {
  return [menu, ...menu.children].some((one) => one.getClientRects().length > 0);
}

/**
 * @param {() => boolean} use
 * @returns {boolean} Whether it used the key; false after an error, which must never
 *     prevent a STOP.
 */
function uses(use) {
  try {
    return use();
  } catch (error) {
    reportError(error);
    return false;
  }
}

/**
 * @param {EventTarget | null} target
 * @returns {boolean} Whether the focused element uses Escape itself.
 */
function keepsEscape(target) {
  if (!(target instanceof Element)) return false;
  // A manual popover, such as the alarm, does not use Escape.
  const closes = "dialog:modal, [popover]:not([popover=manual]), textarea, select";
  return target.closest(closes) !== null || target.matches(TYPED);
}

/** Elements that Space presses, besides lists and sliders. */
const SPACE_KEPT = "input[type=checkbox], summary, [data-webmap-keeps-space]";

/**
 * @param {EventTarget | null} target
 * @returns {boolean} Whether the focused element uses Space itself, and no other key does the
 *     same; or a button that everybody presses with Space, of a recording, in which no robot
 *     can be driven (`data-webmap-keeps-space`).
 */
function keepsSpace(target) {
  return target instanceof Element && (takesKeys(target) || target.matches(SPACE_KEPT));
}
