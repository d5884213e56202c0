/** The oldest camera picture that an operator may drive by; ms. */
export const BLIND = 1000;

/**
 * The ages of the camera pictures that the operator drives by, for each robot.
 */
export class Pictures {
  constructor() {
    /** @type {Map<string, () => number>} */
    this._ages = new Map();
  }

  /**
   * @param {string} robot
   * @param {() => number} age Age of the picture that is shown now, in ms.
   * @returns {() => void} Ends this.
   */
  goBy(robot, age) {
    this._ages.set(robot, age);
    return () => {
      if (this._ages.get(robot) === age) this._ages.delete(robot);
    };
  }

  /**
   * @param {string} robot
   * @returns {number | undefined} In whole ms; undefined if no camera was chosen.
   */
  age(robot) {
    const age = this._ages.get(robot)?.();
    return age === undefined ? undefined : Math.round(Math.min(Math.max(age, 0), 1e9));
  }

  /**
   * @param {string} robot
   * @returns {boolean} Whether the picture is too old to drive by (S16).
   */
  blind(robot) {
    return (this.age(robot) ?? 0) > BLIND;
  }
}
