import { TAKE_PATIENCE } from "./lease_requests.js";

/** @typedef {import('./loops.js').Loops} Loops */
/** @typedef {import('./pilot.js').Pilot} Pilot */
/** @typedef {import('./stream.js').Command} Command */

/**
 * An operation that the gate has not answered yet.
 *
 * @typedef {object} PendingOperation
 * @property {string} robot
 * @property {string} what
 * @property {number} since
 * @property {() => boolean} reached Whether the gate has accepted it.
 * @property {(problem: string | null) => void} end
 */

/**
 * Sends goals and sets poses: takes the lease of a free robot for that, and waits for the
 * gate's answer.
 *
 * Times are in milliseconds of one clock.
 */
export class PoseCommands {
  /**
   * @param {Pilot} pilot
   * @param {Loops} loops
   * @param {(commands: Command[]) => void} send
   * @param {() => number} clock
   */
  constructor(pilot, loops, send, clock) {
    this._pilot = pilot;
    this._loops = loops;
    this._send = send;
    this._clock = clock;
    /** @type {Set<PendingOperation>} */
    this._pending = new Set();
  }

  /**
   * @param {'goal' | 'locate'} op
   * @param {string} robot
   * @param {{x: number, y: number, yaw: number}} pose Metres and radians.
   * @returns {Promise<boolean>} Whether the lease was taken for this.
   * @throws {Error} When the gate refuses it or does not answer.
   */
  async place(op, robot, { x, y, yaw }) {
    if (![x, y, yaw].every(Number.isFinite)) {
      throw new Error(`A ${op} needs finite numbers, got ${x}, ${y}, ${yaw}.`);
    }
    const taken = this._pilot.epoch(robot) === null;
    if (taken) {
      this._send([{ op: "take", robot }]);
      await this._until(robot, "take", () => this._pilot.epoch(robot) !== null);
    }
    const command = this._pilot.place(op, robot, { x, y, yaw }, this._clock());
    const loop = this._loops.of(robot);
    this._send([command]);
    try {
      await this._until(robot, op, () => loop.acknowledged(command.seq));
    } catch (error) {
      if (taken) this._send(this._pilot.release(robot, this._clock()));
      throw error;
    }
    return taken;
  }

  /**
   * Process a refusal of the gate.
   *
   * @param {string | null} robot
   * @param {string} what
   * @param {string} why
   */
  refused(robot, what, why) {
    for (const operation of this._pending) {
      if (operation.robot === robot && operation.what === what) operation.end(why);
    }
  }

  /** @param {number} now */
  step(now) {
    for (const operation of this._pending) {
      if (operation.reached()) operation.end(null);
      else if (now - operation.since > TAKE_PATIENCE) operation.end("no answer from the gate");
    }
  }

  /**
   * @param {string} robot
   * @param {string} what
   * @param {() => boolean} reached
   * @returns {Promise<void>}
   */
  _until(robot, what, reached) {
    return new Promise((resolve, reject) => {
      /** @type {PendingOperation} */
      const operation = {
        robot,
        what,
        since: this._clock(),
        reached,
        end: (problem) => {
          this._pending.delete(operation);
          if (problem === null) resolve();
          else reject(new Error(problem));
        },
      };
      this._pending.add(operation);
    });
  }
}
