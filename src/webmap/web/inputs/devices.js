/**
 * Which map of the page is driven, and the devices that drive it.
 *
 * This folder reads keys, gamepads and the on-screen stick. Open this file first. What
 * becomes of the inputs is decided in `../motion`.
 */

import { Gamepads } from "./pads.js";
import { Keys } from "./keys.js";

/** @typedef {import('../drive.js').Drive} Drive */

/**
 * A map that robots can be driven from.
 *
 * @typedef {object} DrivingMap
 * @property {object} map
 * @property {() => string | null} robot The robot that is selected there.
 * @property {boolean} holonomic Whether its keys move a base sideways, too.
 * @property {(active: boolean) => void} onActive Called when the page's inputs start or
 *     stop to belong to this map.
 */

/** @type {WeakMap<Drive, Devices>} */
const known = new WeakMap();

/**
 * Return the desk of a page, made when it is first asked for.
 *
 * @param {Drive} drive
 */
export function devicesOf(drive) {
  const devices = known.get(drive) ?? new Devices(drive);
  known.set(drive, devices);
  return devices;
}

/**
 * Where the operator sits: one keyboard and its gamepads for all the maps of a page.
 *
 * They drive the robot that is selected on the map that was touched last, so that two
 * maps on a page never both drive.
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
    this._uses = 0;
    /** @type {Keys | null} */
    this._keys = null;
    /** @type {Gamepads | null} */
    this._pads = null;
  }

  /** Whether a gamepad is there to drive with. */
  get gamepad() {
    return this._pads?.present ?? false;
  }

  /** Whether a gamepad's dead-man button is held that does nothing. */
  get spent() {
    return this._pads?.spent ?? false;
  }

  /**
   * Use the STOP keys and the inputs of the page, whether or not anything can be driven from here.
   *
   * @returns {() => void} Ends the use.
   */
  open() {
    this._uses += 1;
    const owner = {
      wanted: () => this.active?.robot() != null,
      holonomic: () => this.active?.holonomic ?? false,
    };
    this._pads ??= new Gamepads(this._drive, owner);
    this._keys ??= new Keys(this._drive, {
      ...owner,
      stop: (all, event) => this._stop(all, event),
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
   * Drive from a map. The first one is active until another is touched.
   *
   * @param {DrivingMap} map
   * @returns {() => void} Leaves.
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
   * Make a map the one that is driven from.
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

  /** Look again which robot is selected on the active map. */
  choose() {
    this._drive.choose(this.active?.robot() ?? null);
  }

  /**
   * Let Escape end something smaller first: a tool, a menu. Not while a robot is driven.
   *
   * @param {() => boolean} leave Returns whether there was something to end.
   * @returns {() => void} Gives the key back.
   */
  claimEscape(leave) {
    this._escapes.add(leave);
    return () => {
      this._escapes.delete(leave);
    };
  }

  /**
   * @param {boolean} all
   * @param {KeyboardEvent} event
   */
  _stop(all, event) {
    const { driven, taking, choice } = this._drive.status;
    if (all) {
      this._drive.stop("*");
      return true;
    }
    const drives = driven !== null || taking;
    if (!drives && keepsKey(event)) return false;
    if (!drives && event.code === "Escape") {
      const held = choice !== null && this._drive.robots.get(choice)?.mine;
      if (!held && leaves(closesMenu)) return true;
      for (const leave of this._escapes) if (leaves(leave)) return true;
    }
    // With none to mean they mean all: a STOP too many is harmless.
    this._drive.stop(driven ?? choice ?? "*");
    return true;
  }
}

/** Inputs in which Escape has a use of its own. */
const TYPED = "input:not([type=checkbox], [type=radio], [type=button], [type=submit])";

/** What Escape closes: elements with the attribute, and popovers of the browser. */
const MENUS = "[data-webmap-menu], [popover]:not([popover=manual])";

/**
 * Close an open menu. Not under the alarm, which covers it.
 *
 * @returns {boolean} Whether there was one.
 */
function closesMenu() {
  if (document.querySelector(".webmap-alarm")) return false;
  /** @type {NodeListOf<HTMLElement>} */
  const found = document.querySelectorAll(MENUS);
  const open = [...found].filter((one) => one.matches("[open], :popover-open"));
  const menu = open.find((one) => one.getClientRects().length > 0);
  if (!menu) return false;
  const inside = menu.contains(document.activeElement);
  if (menu instanceof HTMLDialogElement) menu.close();
  else if (menu instanceof HTMLDetailsElement) menu.open = false;
  else menu.hidePopover();
  // On the line that folds a menu out the space bar would be no STOP.
  const map = /** @type {SVGElement | null} */ (document.querySelector("svg.webmap"));
  if (inside) map?.focus();
  return true;
}

/**
 * @param {() => boolean} leave
 * @returns {boolean} Whether it ended something. One that fails did not, as it must never
 *     keep a STOP from leaving.
 */
function leaves(leave) {
  try {
    return leave();
  } catch (error) {
    reportError(error);
    return false;
  }
}

/**
 * @param {KeyboardEvent} event
 * @returns {boolean} Whether the key has a meaning of its own where it was pressed, and
 *     nothing else (Enter, a click) would do the same.
 */
function keepsKey(event) {
  const target = event.target;
  if (!(target instanceof Element)) return false;
  if (event.code === "Escape") {
    // One that is opened and closed by hand alone, as the alarm is, has no use for it.
    const closes = "dialog:modal, [popover]:not([popover=manual]), textarea, select";
    return target.closest(closes) !== null || target.matches(TYPED);
  }
  return target.matches("input[type=checkbox], input[type=radio], select, summary");
}
