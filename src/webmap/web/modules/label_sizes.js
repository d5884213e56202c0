import { scaleOf } from "../view.js";

/** @typedef {import('../map.js').MapCanvas} MapCanvas */
/** @typedef {{x: number, y: number, across: number}} Name */

/** Half of what a name and its spot take up and down, in pixels. */
const HEIGHT = 46;

/**
 * Choose whose names are shown, so that none lies on another.
 *
 * @param {Name[]} names Where they are on the screen, and how wide, in pixels; the first
 *     comes first.
 * @returns {boolean[]} For each whether there is no room for it.
 */
export function crowded(names) {
  /** @type {Name[]} */
  const shown = [];
  return names.map((name) => {
    const hit = shown.some(
      (other) =>
        Math.abs(name.x - other.x) < (name.across + other.across) / 2 + 4 &&
        Math.abs(name.y - other.y) < HEIGHT,
    );
    if (!hit) shown.push(name);
    return hit;
  });
}

/**
 * Keep labels upright and as large, whatever the view, and names from lying on others.
 *
 * @param {MapCanvas} map
 * @returns {() => void} Ends it.
 */
export function keepLabels(map) {
  let frame = 0;
  const look = () => {
    frame = 0;
    const { a, b } = map.view;
    const { style } = map.svg;
    style.setProperty("--label-size", (1 / scaleOf(map.view)).toPrecision(6));
    style.setProperty("--label-turn", `${Math.atan2(b, a).toFixed(5)}rad`);
    const labels = [...map.world.querySelectorAll(".labels > .label")];
    const names = labels.map((label) => {
      const m = label instanceof SVGGraphicsElement ? label.getCTM() : null;
      const text = label.querySelector(".name");
      const across = text instanceof SVGTextElement ? text.getComputedTextLength() : 0;
      return { x: m?.e ?? 0, y: m?.f ?? 0, across: Math.max(across, 30) };
    });
    crowded(names).forEach((hit, i) => labels[i].classList.toggle("crowded", hit));
  };
  const soon = () => {
    if (frame === 0) frame = requestAnimationFrame(look);
  };
  const off = map.onView(soon);
  const observer = new MutationObserver((records) => {
    const among = (/** @type {Node} */ node) =>
      node instanceof Element && node.closest(".labels") !== null;
    if (records.some(({ target }) => among(target))) soon();
  });
  observer.observe(map.world, { childList: true, subtree: true });
  look();
  return () => {
    cancelAnimationFrame(frame);
    observer.disconnect();
    off();
    map.svg.style.removeProperty("--label-size");
    map.svg.style.removeProperty("--label-turn");
  };
}
