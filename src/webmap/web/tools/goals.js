/** Goals of robots: their texts, which of them a page shows, and sending them. */

import { GOALS } from "../constants.js";
import { isOver } from "../motion/report.js";

/** @typedef {import('../motion/report.js').GoalReport} GoalReport */

/**
 * The look of a goal; text and shape always belong together.
 *
 * @typedef {object} GoalLook
 * @property {string} text
 * @property {string} shape
 * @property {boolean} over Whether it has ended.
 */

/**
 * @param {GoalReport} goal
 * @returns {GoalLook}
 */
export function look(goal) {
  const [word, shape] = GOALS[goal.state] ?? GOALS.unknown;
  const over = isOver(goal);
  const parts = [];
  if (goal.state === "under way" || goal.state === "cancelling") {
    if (goal.left !== null) parts.push(`${metres(goal.left)} to go`);
    if (goal.eta !== null) parts.push(`about ${seconds(goal.eta)} left`);
    if (goal.recoveries) parts.push(recoveries(goal.recoveries));
  }
  if (goal.why !== "") parts.push(goal.why);
  return { text: [word, ...parts].join(", "), shape, over };
}

/** @param {number} number */
function recoveries(number) {
  return number === 1 ? "1 recovery" : `${number} recoveries`;
}

/** @param {number} number */
export function metres(number) {
  return `${number < 10 ? number.toFixed(1) : Math.round(number)} m`;
}

/** @param {number} number */
export function seconds(number) {
  if (number < 90) return `${Math.round(number)} s`;
  return `${Math.round(number / 60)} min`;
}

/** Milliseconds for which a reached or cancelled goal stays on the map. */
const LINGER = 4000;

/** Decides which goals a page shows. Times are in milliseconds of one clock. */
export class ShownGoals {
  constructor() {
    /** @type {Map<string, {goal: GoalReport | null, endedAt: number | null}>} */
    this._seen = new Map();
    /** @type {Set<string>} */
    this._dismissed = new Set();
  }

  /**
   * Update a robot's goal from a report of the gate.
   *
   * @param {string} robot
   * @param {GoalReport | null | undefined} goal
   * @param {number} now
   */
  report(robot, goal, now) {
    const known = this._seen.get(robot);
    if (!goal) {
      this._seen.set(robot, { goal: null, endedAt: null });
      return;
    }
    // A goal that had ended before the first report of the robot is not shown. A later
    // goal may end before the page gets a report of its progress.
    const { over } = look(goal);
    const since = known?.goal?.id === goal.id ? (known.endedAt ?? now) : now;
    const endedAt = over ? (known === undefined ? -Infinity : since) : null;
    this._seen.set(robot, { goal, endedAt });
  }

  /** @param {string} robot */
  gone(robot) {
    this._seen.delete(robot);
  }

  /**
   * Hide a goal.
   *
   * @param {string} robot
   */
  dismiss(robot) {
    const seen = this._seen.get(robot);
    if (seen?.goal) this._dismissed.add(seen.goal.id);
  }

  /**
   * @param {number} now
   * @returns {Map<string, GoalReport>} The goals to show, by robot.
   */
  shown(now) {
    const shown = new Map();
    for (const [robot, { goal, endedAt }] of this._seen) {
      if (goal === null || this._dismissed.has(goal.id)) continue;
      const old = endedAt !== null && now - endedAt > LINGER;
      const failed = goal.state === "failed" && endedAt !== -Infinity;
      if (!old || failed) shown.set(robot, goal);
    }
    return shown;
  }
}

/** Number of attempts to send a goal, and the milliseconds between two attempts. */
export const TRIES = 13;
export const RETRY = 250;

/**
 * Send a goal, again for about three seconds while the gate has no connection for it.
 *
 * The goal of an action uses up the connection of all robots behind that bridge, and
 * the gate opens a new one a moment later. A goal refused for this reason was not sent
 * to the robot, so this is the only refusal after which a goal is sent again.
 *
 * @param {() => Promise<void>} offer Sends it to the gate once.
 * @param {() => boolean} wanted Whether to send it still; checked after every wait.
 * @returns {Promise<boolean>} Whether the gate has accepted it; false if it was
 *     cancelled in between, after which nothing is sent.
 * @throws {Error} If the gate refuses it for another reason, or at the last attempt.
 */
export async function sendGoal(offer, wanted) {
  for (let tries = 1; ; tries++) {
    try {
      await offer();
      return true;
    } catch (error) {
      const linkless = error instanceof Error && error.message.startsWith("no connection to");
      if (!linkless || tries === TRIES) throw error;
    }
    await new Promise((resolve) => setTimeout(resolve, RETRY));
    if (!wanted()) return false;
  }
}
