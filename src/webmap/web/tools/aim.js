import { devicesOf } from "../inputs/devices.js";
import { apply, unapply } from "../view.js";
import { claimPresses } from "./tool.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {import('../view.js').Matrix} Matrix */
/** @typedef {import('../view.js').Point} Point */

/** @typedef {{x: number, y: number, yaw: number}} Pose Metres and radians. */

/** A drag shorter than this in pixels gives a position but no heading. */
const HEADING_FROM = 12;

/**
 * Return the pose of a press and a drag on the map.
 *
 * @param {Matrix} view
 * @param {Point} from Position of the press, in pixels.
 * @param {Point} to Position of the pointer, in pixels.
 * @param {Pose | null} robot Pose of the robot; if the drag gives no heading, the pose
 *     has the heading from the robot to the press.
 * @returns {Pose}
 */
export function aim(view, from, to, robot) {
  const place = unapply(view, from.x, from.y);
  if (Math.hypot(to.x - from.x, to.y - from.y) < HEADING_FROM) {
    return { ...place, yaw: robot ? heading(robot, place, robot.yaw) : 0 };
  }
  return { ...place, yaw: heading(place, unapply(view, to.x, to.y), 0) };
}

/**
 * Return the position and direction of a pose on the screen.
 *
 * @param {Matrix} view
 * @param {Pose} pose
 * @returns {{x: number, y: number, degrees: number}} Clockwise, as in SVG.
 */
export function onScreen(view, { x, y, yaw }) {
  const place = apply(view, x, y);
  const ahead = apply(view, x + Math.cos(yaw), y + Math.sin(yaw));
  const angle = Math.atan2(ahead.y - place.y, ahead.x - place.x);
  return { ...place, degrees: (angle * 180) / Math.PI };
}

/** Distance of one press of an arrow key in pixels, and its rotation in radians. */
const KEY_MOVE = 10;
const KEY_TURN = Math.PI / 12;

/** @type {Record<string, [number, number]>} Right and down on the screen. */
export const ARROWS = {
  ArrowRight: [1, 0],
  ArrowLeft: [-1, 0],
  ArrowDown: [0, 1],
  ArrowUp: [0, -1],
};

/**
 * Return a pose after the press of an arrow key: it moves on the screen, and with Shift
 * turns to the left or the right.
 *
 * @param {Matrix} view
 * @param {Pose} pose
 * @param {string} key
 * @param {boolean} turns Whether Shift is held.
 * @returns {Pose | null} null for any other key.
 */
export function moved(view, pose, key, turns) {
  const arrow = ARROWS[key];
  if (!arrow) return null;
  if (turns) {
    const by = { ArrowLeft: KEY_TURN, ArrowRight: -KEY_TURN }[key] ?? 0;
    const yaw = pose.yaw + by;
    return { ...pose, yaw: Math.atan2(Math.sin(yaw), Math.cos(yaw)) };
  }
  const { x, y } = apply(view, pose.x, pose.y);
  const place = unapply(view, x + KEY_MOVE * arrow[0], y + KEY_MOVE * arrow[1]);
  return { ...place, yaw: pose.yaw };
}

/**
 * @param {Point} from
 * @param {Point} to
 * @param {number} otherwise The heading if both positions are equal.
 */
function heading(from, to, otherwise) {
  const [dx, dy] = [to.x - from.x, to.y - from.y];
  return dx === 0 && dy === 0 ? otherwise : Math.atan2(dy, dx);
}

/**
 * The callbacks of a tool that aims.
 *
 * @typedef {object} Aims
 * @property {() => boolean} mayBegin Whether there is anything to aim for.
 * @property {(active: boolean) => void} changed Aiming started or ended.
 * @property {(pose: Pose | null, alt: boolean) => void} preview The current pose; null
 *     when the press was cancelled. `alt`: whether Alt is held.
 * @property {(pose: Pose, alt: boolean) => void} done The press was released at this pose.
 * @property {(place: Point | null) => void} [hover] The mouse is over this place, in
 *     metres, without a press; null when it has left the map.
 * @property {() => Pose | null} [origin] The start of the heading of a press without a
 *     drag; the selected robot if not given.
 * @property {boolean} [lasting] It stays active for several presses: a tool that aims
 *     once in between returns the map to it.
 */

/** @type {WeakMap<MapCanvas, PressAim>} The active tool of a map. */
const active = new WeakMap();

/**
 * Aims a pose on a map: press for the position, drag for the heading, release. On the
 * keyboard, arrow keys move a mark that begins at the robot, Shift with left or right
 * turns the mark, and Enter ends; see {@link moved}.
 *
 * Starts with a key or {@link PressAim#activate}; Escape ends it. One tool of a map
 * aims at a time; a lasting tool continues after another has aimed in between.
 */
export class PressAim {
  /**
   * @param {MapCanvas} map
   * @param {string} key
   * @param {Aims} aims
   */
  constructor(map, key, aims) {
    this._map = map;
    this._key = key;
    this._aims = aims;
    this.active = false;
    /** @type {PressAim | null} The tool that continues when this one has ended. */
    this._interrupted = null;
    /** @type {{id: number, from: Point, robot: string | null} | null} */
    this._press = null;
    /** @type {Pose | null} The mark that the keyboard moves. */
    this._mark = null;
    this._ending = new AbortController();
    this._listen();
    this._offs = [
      devicesOf(map.drive).claimEscape(() => this.leave()),
      devicesOf(map.drive).claimKeys((event) => this._keyed(event)),
    ];
  }

  destroy() {
    this._interrupted = null;
    this.leave();
    this._ending.abort();
    for (const off of this._offs) off();
  }

  toggle() {
    this.activate(!this.active);
  }

  /** Whether it continues as soon as another tool has aimed. */
  get waits() {
    return active.get(this._map)?._interrupted === this;
  }

  /** @param {boolean} on */
  activate(on) {
    const was = this.active;
    this.active = on && !this._ending.signal.aborted && this._aims.mayBegin();
    if (this.active) this._takeMap();
    const back = this.active ? null : this._leaveMap();
    if (this.active !== was) {
      claimPresses(this._map.svg, "aim", active.has(this._map));
    }
    this._aims.changed(this.active);
    // Else the next press of the interrupted tool would select no robot.
    if (!active.has(this._map)) back?.activate(true);
  }

  _takeMap() {
    const other = active.get(this._map);
    active.set(this._map, this);
    if (!other || other === this) return;
    const back = other._aims.lasting ? other : other._interrupted;
    other._interrupted = null;
    this._interrupted = back === this ? null : back;
    other.leave();
  }

  /** @returns {PressAim | null} The tool that continues now. */
  _leaveMap() {
    const back = this._interrupted;
    this._interrupted = null;
    this.drop();
    if (active.get(this._map) === this) active.delete(this._map);
    return back;
  }

  /** @returns {boolean} Whether the tool was active. */
  leave() {
    if (!this.active) return false;
    this.activate(false);
    return true;
  }

  /** Cancel the current press, if there is one. */
  drop() {
    if (!this._press && !this._mark) return;
    this._press = null;
    this._mark = null;
    this._aims.preview(null, false);
  }

  _listen() {
    const { signal } = this._ending;
    const { svg } = this._map;
    // Captured first, so that a press while aiming neither moves nor selects.
    const first = { signal, capture: true };
    svg.addEventListener("pointerdown", (event) => this._down(event), first);
    svg.addEventListener("pointermove", (event) => this._move(event), first);
    svg.addEventListener("pointerup", (event) => this._up(event), first);
    svg.addEventListener("pointerleave", () => this.active && this._aims.hover?.(null), first);
    svg.addEventListener("pointercancel", () => this.drop(), first);
    svg.addEventListener("lostpointercapture", () => this.drop(), first);
    const devices = devicesOf(this._map.drive);
    devices.listenToTool(this._map, this._key, () => this.toggle(), signal);
  }

  /**
   * @param {KeyboardEvent} event
   * @returns {boolean} Whether the key moved the mark, or ended with it.
   */
  _keyed({ key, shiftKey, ctrlKey, altKey, metaKey, isComposing }) {
    if (!this.active || this._press || ctrlKey || metaKey || isComposing) return false;
    const mark = this._mark;
    if (key === "Enter" && mark) {
      this._mark = null;
      this._aims.done(mark, altKey);
      return true;
    }
    if (altKey) return false;
    const next = moved(this._map.view, mark ?? this._beginning(), key, shiftKey);
    if (!next) return false;
    this._mark = next;
    this._aims.preview(next, false);
    return true;
  }

  /** @returns {Pose} Where the mark begins: at the robot, or in the middle of the map. */
  _beginning() {
    const { view, width, height, selected } = this._map;
    const origin = this._aims.origin?.() ?? (selected === null ? null : poseOf(this._map, selected));
    return origin ?? { ...unapply(view, width / 2, height / 2), yaw: 0 };
  }

  /** @param {PointerEvent} event */
  _down(event) {
    if (!this.active) return;
    this._mark = null;
    event.stopImmediatePropagation();
    event.preventDefault();
    if (this._press || event.button !== 0) {
      // A second finger cancels the press of the first.
      this.drop();
      return;
    }
    const { selected: robot } = this._map;
    this._press = { id: event.pointerId, from: this._map.pointOf(event), robot };
    this._map.svg.setPointerCapture(event.pointerId);
    this._preview(event);
  }

  /** @param {PointerEvent} event */
  _move(event) {
    if (!this.active) return;
    event.stopImmediatePropagation();
    if (event.pointerId === this._press?.id) this._preview(event);
    else if (!this._press && event.pointerType === "mouse" && this._aims.hover) {
      this._aims.hover(this._map.worldOf(event));
    }
  }

  /** @param {PointerEvent} event */
  _up(event) {
    if (event.pointerId !== this._press?.id) return;
    event.stopImmediatePropagation();
    this._map.suppressNextClick();
    const pose = this._preview(event);
    this._press = null;
    if (pose) this._aims.done(pose, event.altKey);
  }

  /**
   * @param {PointerEvent} event
   * @returns {Pose | null}
   */
  _preview(event) {
    const press = this._press;
    if (!press) return null;
    const selected = press.robot === null ? null : poseOf(this._map, press.robot);
    const origin = this._aims.origin ? this._aims.origin() : selected;
    const pose = aim(this._map.view, press.from, this._map.pointOf(event), origin);
    this._aims.preview(pose, event.altKey);
    return pose;
  }
}

/**
 * @param {MapCanvas} map
 * @param {string} robot
 * @returns {Pose | null} Pose of the robot on the map; null if it is not shown.
 */
export function poseOf(map, robot) {
  const element = map.world.querySelector(`.robot[data-robot="${CSS.escape(robot)}"]`);
  if (!(element instanceof SVGGraphicsElement)) return null;
  map.crowd.draw(element);
  const onMap = element.getCTM();
  const world = map.world.getCTM();
  if (!onMap || !world) return null;
  const { a, b, e, f } = world.inverse().multiply(onMap);
  return { x: e, y: f, yaw: Math.atan2(b, a) };
}

/**
 * @param {MapCanvas} map
 * @returns {string[]} The selected robots: the main one, and the other marked ones.
 */
export function chosen(map) {
  if (map.selected === null) return [];
  const marked = [...map.world.querySelectorAll(".robot.marked")].flatMap(
    (element) => element.getAttribute("data-robot") ?? [],
  );
  return [map.selected, ...marked.filter((robot) => robot !== map.selected)];
}
