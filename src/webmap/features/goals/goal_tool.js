import { SPACING } from "../../web/constants.js";
import { chosen, poseOf, PressAim } from "../../web/tools/aim.js";
import { button, html, onBeat, setAttribute, setHidden, setText } from "../../web/tools/elements.js";
import { GoalMarks, GroundMark } from "./goal_marks.js";
import { look, sendGoal, ShownGoals } from "../../web/tools/goals.js";
import { endOf, lay } from "../../web/tools/overlay.js";
import { showNote, tool, toolName } from "../../web/tools/tool.js";

/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */
/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('../../web/view.js').Point} Point */

/** @typedef {(message: object) => void} Send */
/** @typedef {{button?: boolean, key?: string, spacing?: number}} Options */

/**
 * Send the selected robots: press at the goal, drag for the heading, release. Or move the
 * mark with the arrow keys, turn it with Shift, and press Enter. Each press sends the next
 * robot; with Alt, or while **Formation** is pressed, it sends all that are left beside each
 * other.
 *
 * The tool begins with its button, with `g`, or with a message `{active: true}`; Escape
 * ends it. It takes control where needed. A message `{reached: id}` removes the goal of
 * a robot. Sends `{goal: {robot, x, y, yaw}}` when the gate has accepted a goal,
 * `{cancel: robot}`, `{mark: robot}` after a long press on a robot, and `{ground: {x, y}}`
 * to ask for the cell of the map under the aimed goal, answered by `{ground: {x, y, word}}`.
 *
 * Options: `button` (true), whether there are buttons; `key` ("g"); `spacing` (1), the
 * distance between several robots that are sent together, in metres.
 *
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {Send} send
 * @returns {BrowserPart}
 */
export default function attach(map, options, send) {
  return new GoalTool(map, options, send);
}

class GoalTool {
  /**
   * @param {MapCanvas} map
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, { button: buttons = true, key = "g", spacing = 1 }, send) {
    this._map = map;
    /** @type {import('../../web/drive.js').Drive} */
    this._drive = map.drive;
    this._send = send;
    /**
     * Goals of robots, until the gate reports them.
     * @type {Map<string, {pose: Pose, state: 'aimed' | 'asked' | 'sent'}>}
     */
    this._goals = new Map();
    this._shown = new ShownGoals();
    /** The robots that got a goal since the tool began. @type {Set<string>} */
    this._placed = new Set();
    /** Sends goals in the order of the presses. */
    this._sending = Promise.resolve();
    this._ground = new GroundMark(map, (place) => send({ ground: place }));
    this._aim = new PressAim(map, key, {
      mayBegin: () => map.selected !== null,
      changed: (active) => this._changed(active),
      preview: (pose, alt) => this._preview(pose, alt),
      done: (pose, alt) => this._done(pose, alt),
      hover: (place) => this._ground.show(place, this._nextName()),
      origin: () => poseOf(map, this._left()[0] ?? map.selected ?? ""),
    });
    this._wanted = false;
    this._go = button("webmap-aim-go webmap-goal-go", "", () => this._toggle());
    this._go.append(...toolName("goal", "Send goal"));
    this._go.title = `Send goal (${key.toUpperCase()})`;
    this._cancel = button("webmap-goal-cancel", "Cancel goal", () => {
      for (const robot of chosen(map)) this._cancelOne(robot);
    });
    this._message = html("span", "webmap-muted webmap-aim-word webmap-goal-word", { role: "status" });
    this._spacing = html("input", "webmap-goal-spacing-value", {
      type: "number",
      min: `${SPACING[0]}`,
      max: `${SPACING[1]}`,
      step: "0.1",
      value: `${spacing}`,
    });
    this._apart = html(
      "label",
      "webmap-muted webmap-row webmap-goal-spacing",
      {},
      "Spacing in m ",
      this._spacing,
    );
    this._formation = button("webmap-goal-formation", "Formation", () => {
      const pressed = this._formation.getAttribute("aria-pressed") === "true";
      this._formation.setAttribute("aria-pressed", `${!pressed}`);
    });
    this._formation.title = "Send all selected robots with one press (Alt and a press)";
    this._formation.setAttribute("aria-pressed", "false");
    const content = [this._formation, this._apart, this._cancel, this._message];
    this._panel = tool("webmap-aim webmap-goal", "Goals", this._go, ...content);
    this._marks = new GoalMarks(map, (robot) => this._end(robot));
    this.destroy = endOf(
      this._aim,
      this._ground,
      this._marks,
      new Marking(map, (robot) => send({ mark: robot })),
      ...(buttons ? [lay(map, this._panel, "top-left")] : []),
      map.onSelect(() => this._selected()),
      this._drive.on("stop", (robot) => this._stopped(robot)),
      this._drive.on("robot", ({ robot, goal }) => this._hear(robot, goal)),
      this._drive.on("gone", (robot) => this._shown.gone(robot)),
      this._drive.on("refused", ({ robot, what, why }) => this._refused(robot, what, why)),
      // Removes the marks of ended goals, and adds marks when the scene arrives.
      onBeat(() => this._show()),
    );
    for (const { robot, goal } of this._drive.robots.values()) this._hear(robot, goal);
    this._show();
  }

  /** @param {any} message */
  receive(message) {
    if (typeof message?.active === "boolean") {
      this._wanted = message.active;
      this._aim.activate(message.active);
    }
    if (typeof message?.reached === "string") this._forget(message.reached);
    if (message?.ground) this._ground.hear(message.ground);
  }

  _toggle() {
    this._wanted = !this._aim.active;
    this._aim.toggle();
  }

  /** @param {boolean} active */
  _changed(active) {
    if (this._wanted && !active && this._map.selected === null) {
      setText(this._message, "Select a robot first.");
    } else {
      setText(this._message, active ? this._aiming() : "");
    }
    this._wanted = false;
    this._placed.clear();
    this._ground.show(null);
    this._marks.letThrough(active);
    this._show();
  }

  /** @returns {string[]} The selected robots that the next presses are for. */
  _left() {
    return chosen(this._map).filter((robot) => !this._placed.has(robot));
  }

  /** @returns {string} The name of the robot that the next press is for, if others are too. */
  _nextName() {
    const [next] = this._left();
    return chosen(this._map).length > 1 && next ? this._name(next) : "";
  }

  /** @param {string} robot */
  _name(robot) {
    return this._drive.robots.get(robot)?.name ?? robot;
  }

  _aiming() {
    const robots = chosen(this._map).length;
    if (robots < 2) return AIMING;
    return `${this._nextName()} (${this._placed.size + 1} of ${robots}): ${AIMING_NEXT}`;
  }

  /**
   * @param {Pose} pose
   * @param {boolean} alt
   * @returns {[string, Pose][]} The robots that a press here is for, with their goals.
   */
  _places(pose, alt) {
    const together = alt || this._formation.getAttribute("aria-pressed") === "true";
    const robots = together ? this._left() : this._left().slice(0, 1);
    const apart = Number(this._spacing.value);
    const [least, most] = SPACING;
    const spacing = Number.isFinite(apart) && apart >= least ? Math.min(apart, most) : 1;
    const places = formation(pose, robots.length, spacing);
    const from = robots.map((robot) => poseOf(this._map, robot) ?? pose);
    return assign(from, places).map((place, i) => [robots[i], place]);
  }

  /**
   * @param {Pose | null} pose
   * @param {boolean} alt
   */
  _preview(pose, alt) {
    for (const [robot, { state }] of this._goals) {
      if (state === "aimed") this._goals.delete(robot);
    }
    this._ground.show(pose, this._nextName());
    for (const [robot, place] of pose ? this._places(pose, alt) : []) {
      this._goals.set(robot, { pose: place, state: "aimed" });
    }
    this._show();
  }

  /**
   * @param {Pose} pose
   * @param {boolean} alt
   */
  _done(pose, alt) {
    const asked = this._places(pose, alt).map(([robot, place]) => {
      const goal = { pose: place, state: /** @type {'asked' | 'sent'} */ ("asked") };
      this._goals.set(robot, goal);
      this._placed.add(robot);
      return { robot, pose: place, goal };
    });
    if (this._left().length === 0) this._aim.activate(false);
    else setText(this._message, this._aiming());
    this._ground.show(null);
    this._show();
    this._sending = this._sending.then(() => this._ask(asked));
  }

  /** @param {{robot: string, pose: Pose, goal: {state: 'aimed' | 'asked' | 'sent'}}[]} asked */
  async _ask(asked) {
    /** @type {string[]} */
    const problems = [];
    /** @type {string[]} */
    const refused = [];
    for (const { robot, pose, goal } of asked) {
      // A STOP, or another goal, arrived meanwhile.
      if (this._goals.get(robot) !== goal) continue;
      try {
        const accepted = await sendGoal(
          () => this._drive.goal(robot, pose),
          () => this._goals.get(robot) === goal,
        );
        if (!accepted) throw new Error("cancelled");
        if (this._goals.get(robot) === goal) goal.state = "sent";
        if (this._drive.robots.get(robot)?.goal) this._goals.delete(robot);
        this._send({ goal: { robot, ...pose } });
      } catch (error) {
        if (this._goals.get(robot) === goal) this._goals.delete(robot);
        const why = error instanceof Error ? error.message : String(error);
        refused.push(robot);
        const alone = chosen(this._map).length < 2;
        problems.push(alone ? why : `${this._name(robot)}: ${why}`);
      }
      this._show();
    }
    if (problems.length === 0) return;
    showNote(this._message, `Goal not sent: ${problems.join("; ")}`, this._drive, refused);
  }

  /** @param {string} robot */
  _cancelOne(robot) {
    if (!this._runs(robot)) return;
    this._drive.cancel(robot);
    this._send({ cancel: robot });
    this._goals.delete(robot);
    this._show();
  }

  /** @param {string} robot */
  _end(robot) {
    if (this._runs(robot)) this._cancelOne(robot);
    else this._forget(robot);
  }

  /**
   * @param {string} robot
   * @param {import('../../web/motion/report.js').GoalReport | null | undefined} goal
   */
  _hear(robot, goal) {
    this._shown.report(robot, goal, performance.now());
    if (goal && this._goals.get(robot)?.state === "sent") this._goals.delete(robot);
    this._show();
  }

  /**
   * @param {string | null} robot
   * @param {string} what
   * @param {string} why
   */
  _refused(robot, what, why) {
    if (what !== "cancel" || robot === null) return;
    showNote(this._message, `Goal not cancelled: ${why}`, this._drive, [robot]);
  }

  /** @param {string} robot */
  _stopped(robot) {
    if (robot === "*") this._goals.clear();
    this._aim.leave();
    this._goals.delete(robot);
    this._show();
  }

  /** @param {string} robot */
  _forget(robot) {
    this._goals.delete(robot);
    this._shown.dismiss(robot);
    this._show();
  }

  _selected() {
    // The aimed goal was for the robots that were selected before.
    this._aim.leave();
    setText(this._message, "");
    this._show();
  }

  /** @param {string} robot */
  _runs(robot) {
    if (this._goals.get(robot)?.state === "sent") return true;
    const goal = this._drive.robots.get(robot)?.goal;
    return goal !== undefined && goal !== null && !look(goal).over;
  }

  /** @param {string} robot */
  _mayCancel(robot) {
    const report = this._drive.robots.get(robot);
    const asked = report?.goal?.state === "cancelling" && !this._goals.has(robot);
    return this._runs(robot) && report?.cancels !== false && !asked;
  }

  _show() {
    const robots = chosen(this._map);
    const way = robots.some((robot) => this._drive.robots.get(robot)?.method !== null);
    this._go.toggleAttribute("disabled", robots.length === 0 || !way);
    const words = robots.length > 1 ? `Send goal to ${robots.length} robots` : "Send goal";
    setText(/** @type {Element} */ (this._go.lastElementChild), words);
    setAttribute(this._go, "aria-pressed", String(this._aim.active));
    const single = robots.length < 2 || !this._aim.active;
    for (const one of [this._apart, this._formation]) setHidden(one, single);
    setHidden(this._cancel, !robots.some((robot) => this._mayCancel(robot)));
    this._draw(robots);
  }

  /** @param {string[]} robots The selected robots. */
  _draw(robots) {
    /** @type {Parameters<GoalMarks['show']>[0]} */
    const goals = new Map();
    for (const [robot, goal] of this._shown.shown(performance.now())) {
      if (poseOf(this._map, robot) === null) continue;
      const report = this._drive.robots.get(robot);
      const mine = robot === this._map.selected;
      const { name = "", cancels = true } = report ?? {};
      goals.set(robot, { pose: goal, goal, name, mine, cancels });
    }
    for (const [robot, { pose, state }] of this._goals) {
      if (robots.includes(robot)) goals.set(robot, { pose, state, mine: true });
    }
    this._marks.show(goals);
  }
}

const AIMING =
  "Press on the map and drag for the heading. Or use the keys: arrows move, Shift turns, Enter sends.";
const AIMING_NEXT =
  "Press on the map and drag for the heading, then the next. Alt and a press sends all that are left.";

/** Duration of a long press on a robot, in ms. */
const LONG = 500;
/** Greatest movement of the finger during a long press, in pixels. */
const STILL = 10;

/** A long press on a robot: on a touch screen the same as a click with Shift. */
class Marking {
  /**
   * @param {MapCanvas} map
   * @param {(robot: string) => void} mark
   */
  constructor(map, mark) {
    this._map = map;
    this._mark = mark;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this._timer = undefined;
    this._from = { x: 0, y: 0 };
    this._marked = false;
    this._ending = new AbortController();
    const { signal } = this._ending;
    const { svg } = map;
    svg.addEventListener("pointerdown", (event) => this._down(event), { signal });
    svg.addEventListener("pointermove", (event) => this._move(event), { signal });
    for (const end of ["pointerup", "pointercancel"]) {
      svg.addEventListener(end, () => this._up(), { signal });
    }
    // The browser's own menu would end the press.
    const noMenu = (/** @type {MouseEvent} */ event) => robotAt(event) && event.preventDefault();
    svg.addEventListener("contextmenu", noMenu, { signal });
  }

  destroy() {
    clearTimeout(this._timer);
    this._ending.abort();
  }

  /** @param {PointerEvent} event */
  _down(event) {
    clearTimeout(this._timer);
    if (event.pointerType !== "touch" || !event.isPrimary) return;
    const robot = robotAt(event);
    if (robot === null) return;
    this._from = { x: event.clientX, y: event.clientY };
    this._timer = setTimeout(() => {
      this._marked = true;
      this._mark(robot);
    }, LONG);
  }

  _up() {
    clearTimeout(this._timer);
    if (!this._marked) return;
    this._marked = false;
    this._map.suppressNextClick();
  }

  /** @param {PointerEvent} event */
  _move(event) {
    const { x, y } = this._from;
    if (Math.hypot(event.clientX - x, event.clientY - y) > STILL) clearTimeout(this._timer);
  }
}

/** @param {MouseEvent} event */
function robotAt({ target }) {
  const robot = target instanceof Element ? target.closest(".robot") : null;
  return robot?.getAttribute("data-robot") ?? null;
}

/** Greatest number of robots in one line; more robots form a grid. */
const LONGEST_LINE = 4;

/**
 * Return places for several robots around a pose: a line across the heading, or a grid.
 *
 * The middle of the first line is the pose, and every other line is behind it.
 *
 * @param {Pose} pose
 * @param {number} count
 * @param {number} spacing Metres between neighbours.
 * @returns {Pose[]}
 */
export function formation({ x, y, yaw }, count, spacing) {
  const lines = Math.ceil(count / LONGEST_LINE);
  const across = Math.ceil(count / lines);
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  return Array.from({ length: count }, (_, n) => {
    const line = Math.floor(n / across);
    const inLine = Math.min(across, count - line * across);
    const left = ((inLine - 1) / 2 - (n % across)) * spacing;
    const ahead = -line * spacing;
    return { x: x + cos * ahead - sin * left, y: y + sin * ahead + cos * left, yaw };
  });
}

/**
 * Match robots to places so that the sum of their straight distances is small. Two
 * crossing lines can always be shortened by exchanging their ends, so no lines cross.
 *
 * @param {Point[]} robots
 * @param {Pose[]} places As many as there are robots.
 * @returns {Pose[]} The place of each robot.
 */
export function assign(robots, places) {
  const assigned = [...places];
  /** @param {number} robot @param {number} place */
  const way = (robot, place) =>
    Math.hypot(robots[robot].x - assigned[place].x, robots[robot].y - assigned[place].y);
  let better = true;
  while (better) {
    better = false;
    for (let i = 0; i < robots.length; i++) {
      for (let j = i + 1; j < robots.length; j++) {
        if (way(i, j) + way(j, i) < way(i, i) + way(j, j) - 1e-9) {
          [assigned[i], assigned[j]] = [assigned[j], assigned[i]];
          better = true;
        }
      }
    }
  }
  return assigned;
}
