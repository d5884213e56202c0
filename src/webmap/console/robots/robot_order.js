/**
 * The order, the groups and the filter of the list of robots, without the page.
 *
 * @typedef {import('../../web/layout.js').List} Choice What the operator has chosen.
 * @typedef {Choice['order']} Order
 *
 * @typedef {object} Listed
 * @property {string} name
 * @property {string} group The group of its state, such as `stopped`.
 * @property {number} rank The place of that group; 0 is the worst.
 * @property {string} tag Empty if it has none.
 * @property {string} bridge Empty if it has none.
 * @property {number | null} charge In percent; null if it is unknown.
 * @property {number} added The place among the robots as they were added.
 */

/** With more robots than this, the list has the worst first. */
export const MANY = 8;

/** @type {Choice} */
export const AT_FIRST = { order: "auto", group: "none", states: [] };

/** `Robot 2` comes before `Robot 10`. */
const natural = new Intl.Collator(undefined, { numeric: true });

/** @type {Record<Order, (one: Listed, other: Listed) => number>} */
const COMPARE = {
  auto: () => 0,
  added: () => 0,
  name: () => 0,
  state: (one, other) => one.rank - other.rank,
  battery: (one, other) => (one.charge ?? Infinity) - (other.charge ?? Infinity) || 0,
};

/**
 * @param {Order} order
 * @param {number} count Number of robots.
 * @returns {Order} The order that is used.
 */
export function orderFor(order, count) {
  if (order !== "auto") return order;
  return count > MANY ? "state" : "added";
}

/**
 * Return the robots in order, with the name of each group before its robots.
 *
 * @template {Listed} T
 * @param {T[]} robots
 * @param {Choice} choice
 * @returns {{name: string, robots: T[]}[]} One group without a name if there are none.
 */
export function arranged(robots, { order, group }) {
  const used = orderFor(order, robots.length);
  const byName = (/** @type {T} */ one, /** @type {T} */ other) =>
    used === "added" ? 0 : natural.compare(one.name, other.name);
  const sorted = [...robots].sort(
    (one, other) => COMPARE[used](one, other) || byName(one, other) || one.added - other.added,
  );
  if (group === "none") return [{ name: "", robots: sorted }];
  /** @type {Map<string, T[]>} */
  const groups = new Map();
  for (const robot of sorted) {
    const key = robot[group];
    groups.set(key, [...(groups.get(key) ?? []), robot]);
  }
  const names = [...groups.keys()].sort(
    (one, other) => Number(one === "") - Number(other === "") || natural.compare(one, other),
  );
  return names.map((name) => ({
    name: name || `No ${group}`,
    robots: groups.get(name) ?? [],
  }));
}

/**
 * Return how many robots are in each group of states.
 *
 * @param {Listed[]} robots
 * @param {string[]} kept Groups that are listed even without a robot.
 * @returns {{group: string, count: number}[]} The worst first, those without a robot
 *     last.
 */
export function countsOf(robots, kept) {
  const worst = [...robots].sort((one, other) => one.rank - other.rank);
  const counts = new Map(worst.map(({ group }) => [group, 0]));
  for (const { group } of robots) counts.set(group, (counts.get(group) ?? 0) + 1);
  for (const group of kept) if (!counts.has(group)) counts.set(group, 0);
  return [...counts].map(([group, count]) => ({ group, count }));
}

/**
 * @param {Listed} robot
 * @param {string} wanted Part of the name.
 * @param {string[]} states
 */
export function isShown({ name, group }, wanted, states) {
  const named = name.toLowerCase().includes(wanted.trim().toLowerCase());
  return named && (states.length === 0 || states.includes(group));
}
