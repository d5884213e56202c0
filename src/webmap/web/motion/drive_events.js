/** @typedef {import('./report.js').RobotReport} RobotReport */
/** @typedef {'connecting' | 'open' | 'late' | 'lost'} LinkState */

/**
 * The kinds of news, and what each tells.
 *
 * `robot`: the gate's newest word on a robot. `gone`: the gate knows a robot no more.
 * `state`: the link's state changed. `refused`: the gate refused something. `stop`:
 * STOP was sent for a robot or "*". `goal`: a goal was sent for a robot. `read`: inputs
 * that must be asked for their state (gamepads) are asked now. `drop`: inputs must
 * forget what is held. `step`: a 20 Hz step is over.
 *
 * @typedef {object} DriveEvents
 * @property {RobotReport} robot
 * @property {string} gone
 * @property {LinkState} state
 * @property {{robot: string | null, what: string, why: string}} refused
 * @property {string} stop
 * @property {string} goal
 * @property {null} read
 * @property {null} drop
 * @property {null} step
 */

/** @typedef {{[K in keyof DriveEvents]: [kind: K, event: DriveEvents[K]]}[keyof DriveEvents]} DriveEvent */

/** Who wants to hear what. */
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
        // A broken display must never keep a neutral or a STOP from leaving.
        reportError(error);
      }
    }
  }
}
