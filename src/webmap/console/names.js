/** @typedef {import('./console.js').MapCanvas} MapCanvas */

/** Milliseconds between two looks at which names there is room for. */
const PERIOD = 300;

/** How large a name is on the screen, in pixels: about so much a letter, and a line. */
const LETTER = 8;
const LINE = 18;

/** With more robots in sight than this only the selected one has its name. */
const MOST = 150;

/**
 * A name on the screen: its middle and its size, in pixels.
 *
 * @typedef {object} Name
 * @property {number} x
 * @property {number} y
 * @property {number} width
 * @property {boolean} first Whether it comes before the others.
 */

/**
 * Return which names can be shown without covering one another.
 *
 * @param {Name[]} names
 * @returns {boolean[]} For each, whether there is room for it.
 */
export function roomFor(names) {
  const order = names.map((_, index) => index);
  order.sort((a, b) => Number(names[b].first) - Number(names[a].first) || a - b);
  const shown = names.map(() => false);
  /** @type {Name[]} */
  const placed = [];
  for (const index of order) {
    const name = names[index];
    const free = placed.every(
      (other) =>
        Math.abs(other.y - name.y) >= LINE ||
        Math.abs(other.x - name.x) >= (other.width + name.width) / 2,
    );
    if (!free && !name.first) continue;
    shown[index] = true;
    placed.push(name);
  }
  return shown;
}

/**
 * Keep the robots' names on the map from covering one another.
 *
 * @param {MapCanvas} map
 * @returns {() => void} Ends it.
 */
export function spreadNames(map) {
  const spread = () => {
    const robots = [...map.world.querySelectorAll(".robot:not(.unplaced)")];
    const names = robots.map((robot) => nameOf(map, robot));
    const shown =
      robots.length > MOST ? names.map(({ first }) => first) : roomFor(names);
    robots.forEach((robot, index) => {
      if (robot.classList.contains("nameless") !== shown[index]) return;
      robot.classList.toggle("nameless", !shown[index]);
    });
  };
  const timer = setInterval(spread, PERIOD);
  const off = map.onSelect(spread);
  spread();
  return () => {
    clearInterval(timer);
    off();
  };
}

/**
 * @param {MapCanvas} map
 * @param {Element} robot
 * @returns {Name}
 */
function nameOf({ view, selected }, robot) {
  const list = robot instanceof SVGGraphicsElement ? robot.transform.baseVal : null;
  const { e: x, f: y } = list?.numberOfItems ? list.getItem(0).matrix : { e: 0, f: 0 };
  return {
    x: view.a * x + view.c * y + view.e,
    y: view.b * x + view.d * y + view.f,
    width: (robot.getAttribute("data-name")?.length ?? 0) * LETTER,
    first: robot.getAttribute("data-robot") === selected,
  };
}
