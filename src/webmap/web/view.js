/**
 * Transform from world coordinates (metres, y up) to a map's pixels (y down): a point
 * (x, y) maps to (a x + c y + e, b x + d y + f). Never changed, only replaced.
 *
 * @typedef {object} Matrix
 * @property {number} a
 * @property {number} b
 * @property {number} c
 * @property {number} d
 * @property {number} e
 * @property {number} f
 */

/** @typedef {{x: number, y: number}} Point */

/** Least and most pixels per metre. */
export const SMALLEST = 1e-3;
export const LARGEST = 1e6;

/**
 * @param {number} width Pixels across.
 * @param {number} height Pixels down.
 * @returns {Matrix} The world's origin in the middle, one pixel per metre.
 */
export function initialView(width, height) {
  return { a: 1, b: 0, c: 0, d: -1, e: width / 2, f: height / 2 };
}

/**
 * @param {Matrix} m
 * @param {Matrix} n
 * @returns {Matrix} First `n`, then `m`.
 */
export function multiply(m, n) {
  return {
    a: m.a * n.a + m.c * n.b,
    b: m.b * n.a + m.d * n.b,
    c: m.a * n.c + m.c * n.d,
    d: m.b * n.c + m.d * n.d,
    e: m.a * n.e + m.c * n.f + m.e,
    f: m.b * n.e + m.d * n.f + m.f,
  };
}

/**
 * @param {Matrix} m
 * @param {number} x
 * @param {number} y
 * @returns {Point}
 */
export function apply(m, x, y) {
  return { x: m.a * x + m.c * y + m.e, y: m.b * x + m.d * y + m.f };
}

/**
 * @param {Matrix} m
 * @param {number} x
 * @param {number} y
 * @returns {Point} The point that `m` maps to (x, y).
 */
export function unapply(m, x, y) {
  const det = m.a * m.d - m.b * m.c;
  const [dx, dy] = [x - m.e, y - m.f];
  return { x: (m.d * dx - m.c * dy) / det, y: (m.a * dy - m.b * dx) / det };
}

/**
 * @param {Matrix} view
 * @returns {number} Pixels per metre.
 */
export function scaleOf(view) {
  return Math.sqrt(Math.abs(view.a * view.d - view.b * view.c));
}

/**
 * @param {Matrix} view
 * @returns {boolean} Whether a map can be shown with this view.
 */
export function isView(view) {
  const pixels = scaleOf(view);
  return (
    [view.a, view.b, view.c, view.d, view.e, view.f].every(Number.isFinite) &&
    pixels >= SMALLEST * 0.999 &&
    pixels <= LARGEST * 1.001
  );
}

/**
 * @param {Matrix} view
 * @param {number} x Pixels to the right.
 * @param {number} y Pixels down.
 * @returns {Matrix}
 */
export function translate(view, x, y) {
  return { ...view, e: view.e + x, f: view.f + y };
}

/**
 * Zoom about a fixed point, within the limits.
 *
 * @param {Matrix} view
 * @param {number} factor Above 1 zooms in.
 * @param {number} x Pixels from the left.
 * @param {number} y Pixels from the top.
 * @returns {Matrix}
 */
export function scale(view, factor, x, y) {
  const now = scaleOf(view);
  const k = Math.min(Math.max(factor, SMALLEST / now), LARGEST / now);
  return multiply({ a: k, b: 0, c: 0, d: k, e: x - k * x, f: y - k * y }, view);
}

/**
 * Rotate about a fixed point.
 *
 * @param {Matrix} view
 * @param {number} degrees Counter-clockwise on the screen.
 * @param {number} x Pixels from the left.
 * @param {number} y Pixels from the top.
 * @returns {Matrix}
 */
export function rotate(view, degrees, x, y) {
  // Screen y points down, so a mathematically positive angle would be clockwise.
  const angle = (-degrees * Math.PI) / 180;
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const [e, f] = [x - cos * x + sin * y, y - sin * x - cos * y];
  return multiply({ a: cos, b: sin, c: -sin, d: cos, e, f }, view);
}

/**
 * Show a rectangle of the world as large as possible, without changing the rotation.
 *
 * @param {Matrix} view
 * @param {[number, number, number, number]} bounds x and y of two corners, in metres.
 * @param {number} width Pixels across.
 * @param {number} height Pixels down.
 * @param {number} [margin] Pixels left free on each side.
 * @returns {Matrix}
 */
export function fit(view, [x0, y0, x1, y1], width, height, margin = 24) {
  const now = scaleOf(view);
  const corners = [apply(view, x0, y0), apply(view, x1, y0), apply(view, x0, y1)];
  corners.push(apply(view, x1, y1));
  const xs = corners.map((corner) => corner.x);
  const ys = corners.map((corner) => corner.y);
  // A point or a line is shown with some metres around it.
  const across = Math.max(Math.max(...xs) - Math.min(...xs), now);
  const down = Math.max(Math.max(...ys) - Math.min(...ys), now);
  const free = Math.min(margin, width / 4, height / 4);
  const factor = Math.min((width - 2 * free) / across, (height - 2 * free) / down);
  const middle = apply(view, (x0 + x1) / 2, (y0 + y1) / 2);
  const centred = translate(view, width / 2 - middle.x, height / 2 - middle.y);
  return scale(centred, factor, width / 2, height / 2);
}

/**
 * The map's place on the page, in pixels of the page, and the size of the window.
 *
 * @typedef {object} Place
 * @property {number} left
 * @property {number} top
 * @property {number} width
 * @property {number} height
 * @property {string} window
 */

/**
 * Adapt the view to a new place of the map. What the map shows stays at the same place
 * of the page when a panel beside the map opens or closes; with a new size of the
 * window, the middle of the map stays in the middle.
 *
 * @param {Matrix} view
 * @param {Place} before
 * @param {Place} after
 * @param {boolean} centred Whether the middle stays in the middle in any case.
 * @returns {Matrix}
 */
export function adapt(view, before, after, centred) {
  const [wider, higher] = [after.width - before.width, after.height - before.height];
  const [x, y] = [before.left - after.left, before.top - after.top];
  // A map that moved further than its edges was scrolled in a part of the page.
  const far = Math.abs(x) > Math.abs(wider) + 1 || Math.abs(y) > Math.abs(higher) + 1;
  if (centred || far || before.window !== after.window || before.width === 0) {
    return translate(view, wider / 2, higher / 2);
  }
  return translate(view, x, y);
}

/**
 * @param {Matrix} m
 * @param {Matrix} n
 * @returns {boolean} Whether `m` and `n` differ at most by a translation.
 */
export function isShifted(m, n) {
  return m.a === n.a && m.b === n.b && m.c === n.c && m.d === n.d;
}

/**
 * @param {Matrix} m
 * @param {Matrix} n
 * @returns {boolean}
 */
export function isSame(m, n) {
  return isShifted(m, n) && m.e === n.e && m.f === n.f;
}

/**
 * The result of an operation, without unchanged parts.
 *
 * @typedef {object} Outcome
 * @property {Matrix} [view]
 * @property {number} [follow] The element to follow from now on; 0 for none.
 */

/**
 * Compute the result of a program's operation on a view. The default point is the
 * middle.
 *
 * @param {Matrix} view
 * @param {{width: number, height: number}} size Pixels.
 * @param {string} operation
 * @param {number[]} args
 * @returns {Outcome} Empty for an unknown operation.
 */
export function operated(view, { width, height }, operation, args) {
  const [first, x = width / 2, y = height / 2] = args;
  switch (operation) {
    case "follow":
      return { follow: first };
    case "translate":
      return { view: translate(view, first, args[1]) };
    case "scale":
      return { view: scale(view, first, x, y) };
    case "rotate":
      return { view: rotate(view, first, x, y) };
    case "fit": {
      const [x0, y0, x1, y1] = args;
      return { view: fit(view, [x0, y0, x1, y1], width, height), follow: 0 };
    }
    case "set": {
      const [a, b, c, d, e, f] = args;
      return { view: { a, b, c, d, e, f }, follow: 0 };
    }
    default:
      return {};
  }
}

/**
 * The operations for a map: each is executed once, and not before the map has a size.
 */
export class Operations {
  constructor() {
    /** The number of the newest operation. */
    this.applied = 0;
    /** @type {Array<() => void>} */
    this._waiting = [];
  }

  /**
   * Note an operation that came, or that was executed before.
   *
   * @param {number} number Counts operations.
   * @returns {boolean} Whether it is new.
   */
  reach(number) {
    if (number <= this.applied) return false;
    this.applied = number;
    return true;
  }

  /**
   * @param {boolean} sized Whether the map has a size.
   * @param {() => void} operate
   */
  whenSized(sized, operate) {
    if (sized) operate();
    else this._waiting.push(operate);
  }

  /** Execute the waiting operations in order, when the map has a size. */
  goOn() {
    for (const operate of this._waiting.splice(0)) operate();
  }
}

/** Pixels that are invisible. */
const UNSEEN = 0.01;

/** Keeps an element of the world at a fixed position of the screen. */
export class Following {
  constructor() {
    /** The element, or 0. */
    this.id = 0;
    /** @type {Point | null} Its position on the screen. */
    this._place = null;
  }

  /** @param {number} id The element to follow, or 0. */
  start(id) {
    this.id = id;
    this._place = null;
  }

  /** @param {Point | null} place Position of the element, to keep. */
  settle(place) {
    this._place = this.id ? place : null;
  }

  /**
   * @param {Point | null} place Position of the element now.
   * @returns {Point | null} The necessary shift of the view, if any.
   */
  shift(place) {
    if (!place || !this.id) return null;
    this._place ??= place;
    const [x, y] = [this._place.x - place.x, this._place.y - place.y];
    return Math.hypot(x, y) < UNSEEN ? null : { x, y };
  }
}

/** Least milliseconds between two reports of a view. */
export const REPORT_PERIOD = 100;

/** Reports a changed view: soon, not too often, and with a frame if one comes. */
export class ViewReports {
  /** @param {() => void} report */
  constructor(report) {
    this._report = report;
    this._reported = -Infinity;
    this._changed = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this._timer = undefined;
  }

  /** Note a change, to report it at the end of a frame's work. */
  note() {
    this._changed = true;
  }

  /** Note a change, to report it soon, with or without a frame. */
  soon() {
    this._changed = true;
    const wait = this._reported + REPORT_PERIOD - performance.now();
    this._timer ??= setTimeout(() => this._now(), Math.max(0, wait));
  }

  /** Report changes, after a frame has been applied. */
  settle() {
    if (this._changed) this._now();
  }

  /** Stop reporting. */
  end() {
    clearTimeout(this._timer);
  }

  _now() {
    clearTimeout(this._timer);
    this._timer = undefined;
    this._changed = false;
    this._reported = performance.now();
    this._report();
  }
}

/**
 * Marks the pictures of a map that are zoomed out: several of their pixels share one
 * pixel of the screen. The style sheet draws those smoothly and all others crisp:
 * without smoothing, a wall that is one pixel thick disappears when zoomed out.
 *
 * The attribute `data-cell` of a picture is the width of its pixels, in metres.
 */
export class FarPictures {
  /** @param {SVGGElement} world */
  constructor(world) {
    this._world = world;
    /** Pixels of the screen per metre. */
    this._scale = 0;
    const mark = () => this._mark();
    this._said = new MutationObserver(mark);
    this._said.observe(world, { subtree: true, attributeFilter: ["data-cell"] });
    this._added = new MutationObserver(mark);
    this._added.observe(world, { childList: true });
  }

  /** @param {Matrix} view */
  show({ a, b }) {
    const pixels = Math.hypot(a, b) * devicePixelRatio;
    if (pixels === this._scale) return;
    this._scale = pixels;
    this._mark();
  }

  _mark() {
    for (const image of this._world.querySelectorAll("image[data-cell]")) {
      const cell = Number(image.getAttribute("data-cell"));
      image.toggleAttribute("data-far", cell * this._scale < 1);
    }
  }

  end() {
    this._said.disconnect();
    this._added.disconnect();
  }
}
