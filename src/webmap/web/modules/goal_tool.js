import { button, html, say } from "./elements.js";
import { assign, formation } from "./formation.js";
import { GoalMarks } from "./goal_marks.js";
import { look, ShownGoals } from "./goal_words.js";
import { Marking } from "./marking.js";
import { lay } from "./overlay.js";
import { PressAim } from "./press_aim.js";
import { chosen, poseOf } from "./robot_places.js";
import { sendGoal } from "./send_goal.js";

/** @typedef {import('./aim.js').Pose} Pose */
/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {(message: object) => void} Send */
/** @typedef {import('../halves.js').Half} Half */
/** @typedef {{button?: boolean, key?: string, spacing?: number}} Options */

/**
 * Send the selected robots to a place: press there, drag for the heading, release.
 *
 * Begins by its button, by `g`, or by a message `{active: true}`; Escape leaves. Asks
 * for the lease where it needs it. A message `{reached: id}` takes away the goal of a
 * robot. Sends `{goal: {robot, x, y, yaw}}` when the gate has accepted one,
 * `{cancel: robot}`, and `{mark: robot}` when a robot was pressed for long.
 *
 * Options: `button` (true), whether there are buttons; `key` ("g"); `spacing` (1), how
 * far from each other several robots are sent, in metres.
 *
 * @param {MapCanvas} map
 * @param {Options} options
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
   * @param {Options} options
   * @param {Send} send
   */
  constructor(map, { button: buttons = true, key = "g", spacing = 1 }, send) {
    this._map = map;
    /** @type {import('../drive.js').Drive} */
    this._drive = map.drive;
    this._send = send;
    /**
     * Where robots are to go, until the gate tells of it.
     * @type {Map<string, {pose: Pose, state: 'aimed' | 'asked' | 'sent'}>}
     */
    this._goals = new Map();
    this._shown = new ShownGoals();
    this._aim = new PressAim(map, key, {
      mayBegin: () => map.selected !== null,
      changed: (active) => this._changed(active),
      preview: (pose) => this._preview(pose),
      done: (pose) => this._done(pose),
    });
    this._wanted = false;
    this._go = button("webmap-aim-go webmap-goal-go", "Send to a place", () => this._toggle());
    this._go.title = `Key ${key}`;
    this._cancel = button("webmap-goal-cancel", "Cancel the goal", () => this._callOff());
    this._word = html("span", "webmap-aim-word webmap-goal-word", { role: "status" });
    this._spacing = html("input", "webmap-goal-spacing-value", {
      type: "number",
      min: "0.3",
      max: "20",
      step: "0.1",
      value: `${spacing}`,
    });
    this._apart = html(
      "label",
      "webmap-goal-spacing",
      {},
      "apart, in m ",
      this._spacing,
    );
    this._panel = html(
      "section",
      "webmap-panel webmap-aim webmap-goal",
      { "aria-label": "Goals" },
      this._go,
      this._apart,
      this._cancel,
      this._word,
    );
    this._marks = new GoalMarks(map, (robot) => this._end(robot));
    this._marking = new Marking(map, (robot) => send({ mark: robot }));
    this._offs = [
      ...(buttons ? [lay(map, this._panel, "top-left")] : []),
      map.onSelect(() => this._selected()),
      this._drive.on("stop", (robot) => this._stopped(robot)),
      this._drive.on("robot", ({ robot, goal }) => this._hear(robot, goal)),
      this._drive.on("gone", (robot) => this._shown.gone(robot)),
      this._drive.on("refused", ({ robot, what, why }) => this._refused(robot, what, why)),
    ];
    // Goals that have ended leave by themselves, and marks come with the scene.
    this._timer = setInterval(() => this._show(), 250);
    for (const { robot, goal } of this._drive.robots.values()) this._hear(robot, goal);
    this._show();
  }

  destroy() {
    clearInterval(this._timer);
    this._aim.destroy();
    this._marks.destroy();
    this._marking.destroy();
    for (const off of this._offs) off();
  }

  /** @param {any} message */
  receive(message) {
    if (typeof message?.active === "boolean") {
      this._wanted = message.active;
      this._aim.activate(message.active);
    }
    if (typeof message?.reached === "string") this._forget(message.reached);
  }

  _toggle() {
    this._wanted = !this._aim.active;
    this._aim.toggle();
  }

  /** @param {boolean} active */
  _changed(active) {
    if (this._wanted && !active && this._map.selected === null) {
      say(this._word, "Select a robot first.");
    } else {
      say(this._word, active ? "Press on the map, drag for the heading." : "");
    }
    this._wanted = false;
    this._show();
  }

  /**
   * @param {Pose} pose
   * @returns {[string, Pose][]} Where each of the selected robots goes.
   */
  _places(pose) {
    const robots = chosen(this._map);
    const apart = Number(this._spacing.value);
    const spacing = Number.isFinite(apart) && apart >= 0.3 ? Math.min(apart, 20) : 1;
    const places = formation(pose, robots.length, spacing);
    const from = robots.map((robot) => poseOf(this._map, robot) ?? pose);
    return assign(from, places).map((place, i) => [robots[i], place]);
  }

  /** @param {Pose | null} pose */
  _preview(pose) {
    for (const [robot, { state }] of this._goals) {
      if (state === "aimed") this._goals.delete(robot);
    }
    for (const [robot, place] of pose ? this._places(pose) : []) {
      this._goals.set(robot, { pose: place, state: "aimed" });
    }
    this._show();
  }

  /** @param {Pose} pose */
  _done(pose) {
    const places = this._places(pose);
    this._aim.activate(false);
    void this._ask(places);
  }

  /** @param {[string, Pose][]} places */
  async _ask(places) {
    /** @type {string[]} */
    const problems = [];
    const asked = places.map(([robot, pose]) => {
      const goal = { pose, state: /** @type {'asked' | 'sent'} */ ("asked") };
      this._goals.set(robot, goal);
      return { robot, pose, goal };
    });
    this._show();
    for (const { robot, pose, goal } of asked) {
      // A STOP, or another goal, that came meanwhile.
      if (this._goals.get(robot) !== goal) continue;
      try {
        const accepted = await sendGoal(
          () => this._drive.goal(robot, pose),
          () => this._goals.get(robot) === goal,
        );
        if (!accepted) throw new Error("called off");
        if (this._goals.get(robot) === goal) goal.state = "sent";
        if (this._drive.robots.get(robot)?.goal) this._goals.delete(robot);
        this._send({ goal: { robot, ...pose } });
      } catch (error) {
        if (this._goals.get(robot) === goal) this._goals.delete(robot);
        const why = error instanceof Error ? error.message : String(error);
        const name = this._drive.robots.get(robot)?.name ?? robot;
        problems.push(places.length > 1 ? `${name}: ${why}` : why);
      }
      this._show();
    }
    if (problems.length > 0) say(this._word, `Not sent: ${problems.join("; ")}`);
  }

  _callOff() {
    for (const robot of chosen(this._map)) this._cancelOne(robot);
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
   * @param {import('../motion/report.js').GoalWord | null | undefined} goal
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
    if (what === "cancel" && robot !== null) say(this._word, `Not cancelled: ${why}`);
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
    // What is aimed was meant for the robots that were selected then.
    this._aim.leave();
    say(this._word, "");
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
    const way = robots.some((robot) => this._drive.robots.get(robot)?.way !== null);
    this._go.disabled = robots.length === 0 || !way;
    const words = robots.length > 1 ? `Send ${robots.length} to a place` : "Send to a place";
    say(this._go, words);
    this._go.setAttribute("aria-pressed", String(this._aim.active));
    this._apart.hidden = robots.length < 2;
    this._cancel.hidden = !robots.some((robot) => this._mayCancel(robot));
    this._draw(robots);
  }

  /** @param {string[]} robots The selected ones. */
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
