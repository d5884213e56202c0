import { resolve } from "./access.js";
import { BOOLEAN_ATTRIBUTES } from "./opcodes.js";
import { setText } from "./tools/elements.js";

/** @typedef {import('./wire.js').Matrix} Matrix */

/** @typedef {SVGElement | HTMLElement} AnyElement */

const SVG = "http://www.w3.org/2000/svg";
const BOOLEANS = new Set(BOOLEAN_ATTRIBUTES);
/** Changed by the viewer; the attribute has only the initial value. */
const PROPERTIES = new Set(["value", "checked", "selected", "open"]);
const DOT_SIZE = 0.05;

/** Makes matrices and transforms; elements need not be in the document. */
const maker = document.createElementNS(SVG, "svg");

/**
 * @param {string} tag
 * @param {boolean} svg
 * @returns {AnyElement}
 */
export function createElement(tag, svg) {
  return svg ? document.createElementNS(SVG, tag) : document.createElement(tag);
}

/** One element of the scene at one place of the page. */
export class Item {
  /**
   * @param {number} id
   * @param {AnyElement} element
   * @param {Item | null} parent
   */
  constructor(id, element, parent) {
    this.id = id;
    this.element = element;
    this.parent = parent;
    /** @type {Map<number, Item | Text>} The children from the server. */
    this.children = new Map();
    /** @type {ChildNode | null} The node before the server's children, if any. */
    this.anchor = null;
    /** @type {ChildNode | null} The node after all of the server's children. */
    this.tail = null;
    /** @type {string[]} */
    this._classes = [];
    /** @type {SVGMatrix | null} */
    this._matrix = null;
    /** @type {SVGTransform | null} */
    this._transform = null;
    /** @type {string | null} The transform, if it was given as text. */
    this._text = null;
    /** @type {{unit: number, points: Int16Array} | null} */
    this._dots = null;
    /** @type {number | null} */
    this._dotSize = null;
    /** @type {Loading | null} */
    this._loading = null;
    /** @type {import('./crowd.js').Crowd | null} Of its map, if it is a robot's group. */
    this.crowd = null;
  }

  /**
   * @param {string} name
   * @param {string | null} value null to unset it.
   */
  setAttribute(name, value) {
    const { element } = this;
    if (name === "transform") this._setTransform(value);
    else if (name === "href" || name === "src") this._setAddress(name, value);
    else if (value !== null) element.setAttribute(name, value);
    else {
      if (name === "points") this.setLine(0, []);
      element.removeAttribute(name);
    }
    if (PROPERTIES.has(name) && name in element) {
      const property = BOOLEANS.has(name) ? value !== null : (value ?? "");
      Object.assign(element, { [name]: property });
    }
  }

  /**
   * @param {string} name
   * @param {string | null} value
   */
  _setAddress(name, value) {
    const { element } = this;
    if (value === null) {
      element.removeAttribute(name);
      this._loading?.cancel();
      return;
    }
    const address = value.startsWith("#") ? value : resolve(value, document.baseURI);
    if (address === null) {
      throw new Error(`${value} leads to another server and is not followed`);
    }
    if (element instanceof SVGImageElement || element instanceof HTMLImageElement) {
      this._loading ??= new Loading(element);
      this._loading.show(name, address);
    } else element.setAttribute(name, address);
  }

  /** @param {string} names Classes from Python; classes that a page added stay. */
  setClasses(names) {
    const classes = names.split(" ").filter(Boolean);
    const { classList } = this.element;
    classList.remove(...this._classes.filter((name) => !classes.includes(name)));
    classList.add(...classes);
    this._classes = classes;
  }

  /**
   * @param {string} name A custom property.
   * @param {string} value "" to unset it.
   */
  setStyle(name, value) {
    if (name.startsWith("--")) this.element.style.setProperty(name, value);
  }

  /**
   * @param {number} x
   * @param {number} y
   * @param {number} yaw
   */
  setPose(x, y, yaw) {
    const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
    this._place(cos, sin, -sin, cos, x, y);
  }

  /** @param {Matrix} m */
  setMatrix({ a, b, c, d, e, f }) {
    this._place(a, b, c, d, e, f);
  }

  /**
   * @param {number} a
   * @param {number} b
   * @param {number} c
   * @param {number} d
   * @param {number} e
   * @param {number} f
   */
  _place(a, b, c, d, e, f) {
    // The matrix is reused, so that a tick allocates nothing.
    const matrix = (this._matrix ??= maker.createSVGMatrix());
    matrix.a = a;
    matrix.b = b;
    matrix.c = c;
    matrix.d = d;
    matrix.e = e;
    matrix.f = f;
    if (!this.crowd?.defers(this)) this.drawPlace();
  }

  /** Write the newest pose or matrix into the document. */
  drawPlace() {
    const { matrix } = this;
    if (!matrix) return;
    if (this._transform) this._transform.setMatrix(matrix);
    else this._startTransform(matrix);
  }

  /** The newest pose or matrix; null if there is none, or a transform as text. */
  get matrix() {
    return this._matrix;
  }

  /** @param {SVGMatrix} matrix */
  _startTransform(matrix) {
    const { element } = this;
    if (!(element instanceof SVGGraphicsElement)) return;
    const list = element.transform.baseVal;
    this._transform = list.initialize(maker.createSVGTransformFromMatrix(matrix));
    this._text = null;
    this._scaleDots();
  }

  /** @param {string | null} value */
  _setTransform(value) {
    this._transform = null;
    this._matrix = null;
    this._text = value;
    const { element } = this;
    // Chromium does not remove an attribute that was only set through its list.
    if (element instanceof SVGGraphicsElement) element.transform.baseVal.clear();
    if (value === null) element.removeAttribute("transform");
    else element.setAttribute("transform", value);
    this._scaleDots();
  }

  /**
   * Add points to a line and drop the first ones. The browser's own list is changed, so
   * no number becomes text, and a long line takes no longer than a short one.
   *
   * @param {number} total Points that the line has then.
   * @param {number[]} points The x and y of its last points, in metres.
   */
  setLine(total, points) {
    const { points: list } = /** @type {SVGPolylineElement} */ (this.element);
    if (!list) return;
    const kept = total - points.length / 2;
    if (kept === 0) list.clear();
    while (list.numberOfItems > kept) list.removeItem(0);
    for (let i = 0; i < points.length; i += 2) {
      const point = maker.createSVGPoint();
      [point.x, point.y] = [points[i], points[i + 1]];
      list.appendItem(point);
    }
  }

  /**
   * Store points as dots; {@link drawDots} draws them.
   *
   * @param {number} unit Metres in one unit of `points`.
   * @param {Int16Array} points
   */
  setDots(unit, points) {
    const scaled = this._dots?.unit === unit;
    this._dots = { unit, points };
    if (scaled) return;
    // The list is rebuilt, so that there is one scale at its end.
    if (this._transform) this._startTransform(this._transform.matrix);
    else if (this._text !== null) this._setTransform(this._text);
    else this._place(1, 0, 0, 1, 0, 0);
  }

  _scaleDots() {
    if (!this._dots || !(this.element instanceof SVGGraphicsElement)) return;
    const scale = maker.createSVGTransform();
    scale.setScale(this._dots.unit, this._dots.unit);
    this.element.transform.baseVal.appendItem(scale);
  }

  /**
   * Read the size of dots, which makes the browser compute styles.
   *
   * @returns {boolean} Whether the size has changed.
   */
  readDotSize() {
    const text = getComputedStyle(this.element).getPropertyValue("--dot-size");
    const size = Number.parseFloat(text);
    const before = this._dotSize;
    this._dotSize = size > 0 ? size : DOT_SIZE;
    return this._dotSize !== before;
  }

  get knowsDotSize() {
    return this._dotSize !== null;
  }

  /** Draw the points as squares, in whole units: fast to write and to fill. */
  drawDots() {
    if (!this._dots) return;
    const { unit, points } = this._dots;
    const size = Math.max(1, Math.round((this._dotSize ?? DOT_SIZE) / unit));
    const half = size >> 1;
    // Filling closes each square; another command for that costs a fifth of the time.
    const square = `h${size}v${size}h-${size}`;
    let d = "";
    for (let i = 0; i + 1 < points.length; i += 2) {
      d += `M${points[i] - half} ${points[i + 1] - half}${square}`;
    }
    this.element.setAttribute("d", d);
  }

  /** Remove the element from the page. */
  release() {
    this.element.remove();
  }

  /**
   * @param {string} seconds The value of `data-age`.
   * @param {string | null} text The element's text, if it shows the age.
   */
  showAge(seconds, text) {
    const { element } = this;
    if (!this.crowd?.hides(this) && element.getAttribute("data-age") !== seconds) {
      element.setAttribute("data-age", seconds);
    }
    if (text !== null) setText(element, text);
  }
}

/** The element that contains what Python appends to the page; it stays. */
export class BodyItem extends Item {
  /** @override */
  release() {}
}

/** An element of the user's own page, with its original state to restore it. */
export class BoundItem extends Item {
  /**
   * @param {number} id
   * @param {HTMLElement} element
   * @param {Item | null} parent
   */
  constructor(id, element, parent) {
    super(id, element, parent);
    this.anchor = element.lastChild;
    /** @type {Map<string, string | null>} */
    this._own = new Map();
  }

  /**
   * @override
   * @param {string} name
   * @param {string | null} value
   */
  setAttribute(name, value) {
    if (!this._own.has(name)) this._own.set(name, this.element.getAttribute(name));
    super.setAttribute(name, value);
  }

  /** Remove the page's own children of the element. */
  empty() {
    while (this.anchor) {
      const before = this.anchor.previousSibling;
      this.anchor.remove();
      this.anchor = before;
    }
  }

  /**
   * Restore the page's own attributes, but not its own children.
   *
   * @override
   */
  release() {
    for (const [name, value] of this._own) super.setAttribute(name, value);
    this.setClasses("");
    this.element.classList.remove("stale");
  }
}

/** All elements that are drawn as dots, and when to redraw them. */
export class Dots {
  constructor() {
    /** @type {Set<Item>} */
    this._all = new Set();
    /** @type {Set<Item>} Items with new points. */
    this._undrawn = new Set();
    this._restyled = false;
  }

  /**
   * @param {Item} item
   * @param {number} unit Metres in one unit of `points`.
   * @param {Int16Array} points
   */
  set(item, unit, points) {
    item.setDots(unit, points);
    this._all.add(item);
    this._undrawn.add(item);
  }

  /** @param {Item} item */
  forget(item) {
    this._all.delete(item);
    this._undrawn.delete(item);
  }

  /** @param {Item} item */
  has(item) {
    return this._all.has(item);
  }

  /** @returns {number[]} The ids of elements that are shown at no place of the page. */
  unseen() {
    const [seen, unseen] = [new Set(), new Set()];
    for (const { id, element } of this._all) {
      // Chromium's checkVisibility() is wrong for SVG in a group that is not displayed.
      (element.getClientRects().length > 0 ? seen : unseen).add(id);
    }
    return [...unseen].filter((id) => !seen.has(id)).sort((a, b) => a - b);
  }

  /** Note that styles may give other sizes now. */
  restyle() {
    this._restyled = true;
  }

  draw() {
    // All sizes are read before drawing: styles are computed once.
    for (const item of this._restyled ? this._all : this._undrawn) {
      if (!this._restyled && item.knowsDotSize) continue;
      if (item.readDotSize()) this._undrawn.add(item);
    }
    this._restyled = false;
    for (const item of this._undrawn) item.drawDots();
    this._undrawn.clear();
  }
}

/** Milliseconds after which a load that has not ended no longer delays the next one. */
const PATIENCE = 5000;

/**
 * Loads one address of an image at a time: the newest, when the previous has loaded.
 *
 * A browser cancels a load for the next one. An image that changes faster than it loads
 * would never be drawn; this shows fewer of its versions, but each completely.
 */
class Loading {
  /** @param {SVGImageElement | HTMLImageElement} element */
  constructor(element) {
    this._element = element;
    this._busy = false;
    /** @type {[string, string] | null} The attribute and the address to load next. */
    this._next = null;
    this._patience = 0;
    element.addEventListener("load", () => this._done());
    element.addEventListener("error", () => this._done());
  }

  /**
   * @param {string} name The attribute with the address.
   * @param {string} address
   */
  show(name, address) {
    if (this._busy) this._next = [name, address];
    else this._load(name, address);
  }

  /** Load nothing more: the address was removed. */
  cancel() {
    this._next = null;
    this._done();
  }

  /**
   * @param {string} name
   * @param {string} address
   */
  _load(name, address) {
    // The same address again is not loaded, so no event would report its end.
    if (this._element.getAttribute(name) === address) return;
    this._busy = true;
    this._patience = window.setTimeout(() => this._done(), PATIENCE);
    this._element.setAttribute(name, address);
  }

  _done() {
    window.clearTimeout(this._patience);
    this._busy = false;
    const next = this._next;
    this._next = null;
    if (next) this._load(...next);
  }
}
