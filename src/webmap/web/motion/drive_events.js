/** @typedef {import('./report.js').RobotReport} RobotReport */
/** @typedef {'connecting' | 'open' | 'late' | 'lost'} LinkState */

/**
 * The kinds of events, and the value of each.
 *
 * `robot`: the gate's newest report on a robot. `gone`: the gate does not know a robot any
 * more. `state`: the link's state changed. `refused`: the gate refused an operation.
 * `stop`: STOP was sent for a robot or "*". `goal`: a goal was sent for a robot.
 * `gamepad`: why a gamepad cannot drive, in a sentence; empty when it is gone. `read`:
 * inputs without events of their own (gamepads) must be read now. `drop`: inputs must
 * forget what is pressed. `step`: a 20 Hz step has ended.
 *
 * @typedef {object} DriveEvents
 * @property {RobotReport} robot
 * @property {string} gone
 * @property {LinkState} state
 * @property {{robot: string | null, what: string, why: string}} refused
 * @property {string} stop
 * @property {string} goal
 * @property {string} gamepad
 * @property {null} read
 * @property {null} drop
 * @property {null} step
 */

/** @typedef {{[K in keyof DriveEvents]: [kind: K, event: DriveEvents[K]]}[keyof DriveEvents]} DriveEvent */

/** The listeners of each kind of event. */
export class Listeners {
  constructor() {
    /** @type {Map<keyof DriveEvents, Set<Function>>} */
    this._listeners = new Map();
  }

  /**
   * @template {keyof DriveEvents} K
   * @param {K} kind
   * @param {(event: DriveEvents[K]) => void} fn
   * @returns {() => void} Stops listening.
   */
  on(kind, fn) {
    const listeners = this._listeners.get(kind) ?? new Set();
    this._listeners.set(kind, listeners.add(fn));
    return () => {
      listeners.delete(fn);
    };
  }

  /**
   * @template {keyof DriveEvents} K
   * @param {K} kind
   * @param {DriveEvents[K]} event
   */
  emit(kind, event) {
    for (const fn of this._listeners.get(kind) ?? []) {
      try {
        fn(event);
      } catch (error) {
        // An error of a listener must never prevent the sending of neutral or of STOP.
        reportError(error);
      }
    }
  }
}
