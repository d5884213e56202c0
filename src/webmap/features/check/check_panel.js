/**
 * Sends what a check before driving needs: STOP, and the report to the gate. Both go the
 * way of all commands of this page, in the name of its person.
 */

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */

/** @param {MapCanvas} map */
export default function attach(map) {
  return {
    /** @param {{op?: string, robot?: string}} message */
    receive({ op, robot }) {
      if (typeof robot !== "string") return;
      if (op === "stop") map.drive.stop(robot);
      else if (op === "check") map.drive.check(robot);
    },
    destroy() {},
  };
}
