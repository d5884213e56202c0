/** @typedef {import('../map.js').MapCanvas} MapCanvas */

/** For how long a finger rests on a robot until that means something, in ms. */
const LONG = 500;
/** How far it may move meanwhile, in pixels. */
const STILL = 10;

/** A long press on a robot, which is to a finger what Shift is to a mouse. */
export class Marking {
  /**
   * @param {MapCanvas} map
   * @param {(robot: string) => void} mark
   */
  constructor(map, mark) {
    this._map = map;
    this._mark = mark;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this._timer = undefined;
    this._from = { x: 0, y: 0 };
    this._marked = false;
    this._ending = new AbortController();
    const { signal } = this._ending;
    const { svg } = map;
    svg.addEventListener("pointerdown", (event) => this._down(event), { signal });
    svg.addEventListener("pointermove", (event) => this._move(event), { signal });
    for (const end of ["pointerup", "pointercancel"]) {
      svg.addEventListener(end, () => this._up(), { signal });
    }
    // A browser's own menu would take the press away from us.
    svg.addEventListener("contextmenu", (event) => this._noMenu(event), { signal });
  }

  destroy() {
    clearTimeout(this._timer);
    this._ending.abort();
  }

  /** @param {PointerEvent} event */
  _down(event) {
    clearTimeout(this._timer);
    if (event.pointerType !== "touch" || !event.isPrimary) return;
    const robot = robotAt(event);
    if (robot === null) return;
    this._from = { x: event.clientX, y: event.clientY };
    this._timer = setTimeout(() => {
      this._marked = true;
      this._mark(robot);
    }, LONG);
  }

  _up() {
    clearTimeout(this._timer);
    if (!this._marked) return;
    this._marked = false;
    this._map.suppressNextClick();
  }

  /** @param {PointerEvent} event */
  _move(event) {
    const { x, y } = this._from;
    if (Math.hypot(event.clientX - x, event.clientY - y) > STILL) clearTimeout(this._timer);
  }

  /** @param {MouseEvent} event */
  _noMenu(event) {
    if (robotAt(event) !== null) event.preventDefault();
  }
}

/** @param {MouseEvent} event */
function robotAt({ target }) {
  const robot = target instanceof Element ? target.closest(".robot") : null;
  return robot?.getAttribute("data-robot") ?? null;
}
