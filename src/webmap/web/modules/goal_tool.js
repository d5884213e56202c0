import { deskOf } from "../inputs/desk.js";
import { attentive } from "../motion/attention.js";
import { aim, onScreen } from "./aim.js";
import { button, html, say, svg } from "./elements.js";
import { lay } from "./overlay.js";

/** @typedef {import('../view.js').Point} Point */
/** @typedef {import('./aim.js').Pose} Pose */
/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {(message: object) => void} Send */
/** @typedef {import('../halves.js').Half} Half */

/** Points along x, 44 pixels long, with a ring around the place itself. */
const ARROW = "M7 0H34M0 7a7 7 0 1 1 .01 0M44 0 30-8v16z";

/**
 * Send the selected robot to a place: press there, drag for the heading, release.
 *
 * Begins by its button, by `g`, or by a message `{active: true}`; Escape leaves. Asks
 * for the lease where it needs it. A message `{reached: id}` takes away the arrow of a
 * robot. Sends `{goal: {robot, x, y, yaw}}` when the gate has accepted one, and
 * `{cancel: robot}`.
 *
 * Options: `button` (true), whether there are buttons; `key` ("g").
 *
 * @param {MapCanvas} map
 * @param {{button?: boolean, key?: string}} options
 * @param {Send} send
 * @returns {Half}
 */
export default function attach(map, options, send) {
  const tool = new GoalTool(map, options, send);
  return {
    receive: (message) => tool.receive(message),
    destroy: () => tool.destroy(),
  };
}

class GoalTool {
  /**
   * @param {MapCanvas} map
   * @param {{button?: boolean, key?: string}} options
   * @param {Send} send
   */
  constructor(map, { button: buttons = true, key = "g" }, send) {
    this._map = map;
    /** @type {import('../drive.js').Drive} */
    this._drive = map.drive;
    this._send = send;
    this._key = key;
    this._active = false;
    /**
     * A press that is aimed at the moment.
     * @type {{id: number, robot: string, from: Point} | null}
     */
    this._press = null;
    /**
     * Where robots were sent, and how far that is.
     * @type {Map<string, {pose: Pose, state: 'aimed' | 'asked' | 'sent'}>}
     */
    this._goals = new Map();
    this._go = button("webmap-goal-go", "Send to a place", () => this._toggle());
    this._cancel = button("webmap-goal-cancel", "Cancel the goal", () =>
      this._callOff(),
    );
    this._word = html("span", "webmap-goal-word", { role: "status" });
    this._panel = html(
      "section",
      "webmap-panel webmap-goal",
      { "aria-label": "Goals" },
      this._go,
      this._cancel,
      this._word,
    );
    this._go.title = `Key ${key}`;

    this._arrow = svg("path", { d: ARROW });
    this._drawing = svg(
      "svg",
      { class: "webmap-goal-drawing", "aria-hidden": "true" },
      this._arrow,
    );
    this._ending = new AbortController();
    this._listen();
    this._offs = [
      lay(map, this._drawing),
      ...(buttons ? [lay(map, this._panel, "top-left")] : []),
      deskOf(this._drive).claimEscape(() => this._leave()),
      map.onSelect(() => this._selected()),
      map.onView(() => this._draw()),
      this._drive.on("stop", (robot) => this._stopped(robot)),
    ];
    this._show();
  }

  destroy() {
    this._leave();
    this._ending.abort();
    for (const off of this._offs) off();
  }

  /** @param {any} message */
  receive(message) {
    if (typeof message?.active === "boolean") this._activate(message.active);
    if (typeof message?.reached === "string") this._forget(message.reached);
  }

  _listen() {
    const { signal } = this._ending;
    const { svg: root } = this._map;
    // Before anybody else, so that a press while aiming neither moves nor selects.
    const first = { signal, capture: true };
    root.addEventListener("pointerdown", (event) => this._down(event), first);
    root.addEventListener("pointermove", (event) => this._move(event), first);
    root.addEventListener("pointerup", (event) => this._up(event), first);
    root.addEventListener("pointercancel", () => this._drop(), first);
    root.addEventListener("lostpointercapture", () => this._drop(), first);
    window.addEventListener("keydown", (event) => this._keyDown(event), { signal });
  }

  /** @param {KeyboardEvent} event */
  _keyDown(event) {
    if (event.key !== this._key || event.repeat || event.isComposing) return;
    if (event.ctrlKey || event.altKey || event.metaKey || !attentive()) return;
    const { active } = deskOf(this._drive);
    if (active !== null && active.map !== this._map) return;
    this._toggle();
  }

  _toggle() {
    this._activate(!this._active);
  }

  /** @param {boolean} active */
  _activate(active) {
    this._active = active && this._map.selected !== null;
    if (active && !this._active) say(this._word, "Select a robot first.");
    else say(this._word, this._active ? "Press on the map, drag for the heading." : "");
    if (!this._active) this._drop();
    this._map.svg.classList.toggle("webmap-aiming", this._active);
    this._show();
  }

  /** @returns {boolean} Whether there was something to leave. */
  _leave() {
    if (!this._active) return false;
    this._activate(false);
    return true;
  }

  /** @param {PointerEvent} event */
  _down(event) {
    if (!this._active) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    const robot = this._map.selected;
    if (this._press || robot === null || event.button !== 0) {
      // A second finger is a doubt about the first.
      this._drop();
      return;
    }
    this._press = { id: event.pointerId, robot, from: this._map.pointOf(event) };
    this._map.svg.setPointerCapture(event.pointerId);
    this._aim(event);
  }

  /** @param {PointerEvent} event */
  _move(event) {
    if (!this._active) return;
    event.stopImmediatePropagation();
    if (event.pointerId === this._press?.id) this._aim(event);
  }

  /** @param {PointerEvent} event */
  _up(event) {
    const press = this._press;
    if (!press || event.pointerId !== press.id) return;
    event.stopImmediatePropagation();
    this._map.suppressNextClick();
    const pose = this._aim(event);
    this._press = null;
    this._activate(false);
    if (pose) void this._ask(press.robot, pose);
  }

  /** Give up the press that is aimed, if there is one. */
  _drop() {
    const press = this._press;
    this._press = null;
    if (!press) return;
    this._forget(press.robot);
  }

  /**
   * @param {PointerEvent} event
   * @returns {Pose | null}
   */
  _aim(event) {
    const press = this._press;
    if (!press) return null;
    const pose = aim(
      this._map.view,
      press.from,
      this._map.pointOf(event),
      poseOf(this._map, press.robot),
    );
    this._goals.set(press.robot, { pose, state: "aimed" });
    this._show();
    return pose;
  }

  /**
   * @param {string} robot
   * @param {Pose} pose
   */
  async _ask(robot, pose) {
    const goal = { pose, state: /** @type {'asked' | 'sent'} */ ("asked") };
    this._goals.set(robot, goal);
    this._show();
    try {
      await this._drive.goal(robot, pose);
      if (this._goals.get(robot) === goal) goal.state = "sent";
      this._send({ goal: { robot, ...pose } });
    } catch (error) {
      if (this._goals.get(robot) === goal) this._goals.delete(robot);
      const why = error instanceof Error ? error.message : String(error);
      say(this._word, `Not sent: ${why}`);
    }
    this._show();
  }

  _callOff() {
    const robot = this._map.selected;
    if (robot === null) return;
    this._drive.cancel(robot);
    this._send({ cancel: robot });
    this._forget(robot);
  }

  /** @param {string} robot */
  _stopped(robot) {
    if (robot === "*") this._goals.clear();
    this._leave();
    this._forget(robot);
  }

  /** @param {string} robot */
  _forget(robot) {
    this._goals.delete(robot);
    this._show();
  }

  _selected() {
    // What is aimed was meant for the robot that was selected then.
    this._leave();
    say(this._word, "");
    this._show();
  }

  _show() {
    const robot = this._map.selected;
    this._go.disabled = robot === null;
    this._go.setAttribute("aria-pressed", String(this._active));
    this._cancel.hidden = robot === null || this._goals.get(robot)?.state !== "sent";
    this._draw();
  }

  _draw() {
    const robot = this._map.selected;
    const goal = robot === null ? undefined : this._goals.get(robot);
    this._drawing.toggleAttribute("hidden", !goal);
    if (!goal) return;
    const { x, y, degrees } = onScreen(this._map.view, goal.pose);
    this._arrow.setAttribute("transform", `translate(${x} ${y}) rotate(${degrees})`);
    this._arrow.setAttribute("class", `webmap-goal-arrow ${goal.state}`);
  }
}

/**
 * @param {MapCanvas} map
 * @param {string} robot
 * @returns {Pose | null} Where the map shows the robot.
 */
function poseOf(map, robot) {
  const element = map.world.querySelector(`[data-robot="${CSS.escape(robot)}"]`);
  if (!(element instanceof SVGGraphicsElement)) return null;
  const onMap = element.getCTM();
  const world = map.world.getCTM();
  if (!onMap || !world) return null;
  const { a, b, e, f } = world.inverse().multiply(onMap);
  return { x: e, y: f, yaw: Math.atan2(b, a) };
}
