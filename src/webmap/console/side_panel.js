import { byId } from "../web/tools/elements.js";

/**
 * The docked list of robots with the card: its width, whether it is open, and whether
 * the card shows more. They are a part of the layout, and stored in the browser.
 */

/** @typedef {import('../web/map.js').MapCanvas} MapCanvas */
/** @typedef {{open: boolean, width: number, more: boolean}} Shown Width in pixels. */

/** The key of the state in this browser's storage. */
const KEPT = "webmap.panel";

/** Smallest, usual and greatest width in pixels, and the change for one arrow key. */
const NARROWEST = 240;
const USUAL = 296;
const WIDEST = 480;
const STEP = 16;

/** @type {Shown} */
const AT_FIRST = { open: true, width: USUAL, more: false };

/**
 * Open, close and resize the panel.
 *
 * @param {MapCanvas} map
 * @param {AbortSignal} signal
 * @returns {() => void} Leaves the layout.
 */
export function listenToPanel(map, signal) {
  const [edge, turn] = [byId("panel-edge"), byId("panel-turn")];
  let shown = kept();
  const show = (/** @type {Shown} */ next) => {
    const width = Math.round(Math.min(Math.max(next.width, NARROWEST), WIDEST));
    shown = { ...next, width };
    document.body.dataset.panel = shown.open ? "open" : "closed";
    if (width === USUAL) document.documentElement.style.removeProperty("--panel");
    else document.documentElement.style.setProperty("--panel", `${width}px`);
    turn.setAttribute("aria-expanded", `${shown.open}`);
    edge.setAttribute("aria-valuenow", `${width}`);
    const more = moreOfCard();
    if (more && more.open !== shown.more) more.open = shown.more;
  };
  const change = (/** @type {Partial<Shown>} */ part) => {
    show({ ...shown, ...part });
    keep(shown);
  };
  edge.setAttribute("aria-valuemin", `${NARROWEST}`);
  edge.setAttribute("aria-valuemax", `${WIDEST}`);
  // The card may have been unfolded before this module was loaded, and may come later.
  show({ ...shown, more: shown.more || moreOfCard()?.open === true });
  const off = map.onSelect(() => show(shown));
  const folded = (/** @type {Event} */ { target }) => {
    if (target === moreOfCard()) change({ more: moreOfCard()?.open });
  };
  byId("card").addEventListener("toggle", folded, { signal, capture: true });
  turn.addEventListener("click", () => change({ open: !shown.open }), { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    const by = { ArrowLeft: -STEP, ArrowRight: STEP }[event.key];
    if (by === undefined) return;
    // The arrow keys drive the robot everywhere else.
    event.preventDefault();
    event.stopPropagation();
    change({ width: shown.width + by });
  };
  edge.addEventListener("keydown", key, { signal });
  listenToEdge(edge, (x) => change({ width: x }), signal);
  edge.addEventListener("dblclick", () => change({ width: USUAL }), { signal });
  const leave = map.layout.add("panel", {
    read: () => shown,
    write: change,
    reset: () => change(AT_FIRST),
  });
  return () => {
    off();
    leave();
  };
}

/**
 * @param {HTMLElement} edge
 * @param {(x: number) => void} moved Called with the pointer's place in the window.
 * @param {AbortSignal} signal
 */
function listenToEdge(edge, moved, signal) {
  const down = (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0) return;
    event.preventDefault();
    edge.setPointerCapture(event.pointerId);
    edge.classList.add("dragged");
  };
  const move = (/** @type {PointerEvent} */ event) => {
    if (edge.classList.contains("dragged")) moved(event.clientX);
  };
  const up = () => edge.classList.remove("dragged");
  edge.addEventListener("pointerdown", down, { signal });
  edge.addEventListener("pointermove", move, { signal });
  edge.addEventListener("pointerup", up, { signal });
  edge.addEventListener("pointercancel", up, { signal });
}

/** @returns {HTMLDetailsElement | null} */
function moreOfCard() {
  return document.querySelector("#card > details.more");
}

/** @returns {Shown} */
function kept() {
  try {
    const { open, width, more } = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    return {
      open: open !== false,
      width: Number.isFinite(width) ? width : USUAL,
      more: more === true,
    };
  } catch {
    return AT_FIRST;
  }
}

/** @param {Shown} shown */
function keep(shown) {
  try {
    localStorage.setItem(KEPT, JSON.stringify(shown));
  } catch {
    // A browser without storage opens the page with the usual panel.
  }
}
