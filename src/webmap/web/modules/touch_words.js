/** @typedef {import('../motion/status.js').Description} Description */

/**
 * Say without keys what can be said without them, where fingers drive by the stick:
 * a phone has no Space.
 *
 * @param {Description} description
 * @param {{touch: boolean, stick: boolean}} what Whether fingers are the pointer, and
 *     whether the stick is there.
 * @param {string} inputs What there is to drive with.
 * @returns {Description}
 */
export function withoutKeys(description, { touch, stick }, inputs) {
  if (!touch || !stick || description.state !== "ready") return description;
  return { ...description, detail: `Hold ${inputs} to drive, let go to stop.` };
}
