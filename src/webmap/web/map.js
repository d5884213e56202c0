import { Crowd } from "./crowd.js";
import { LayoutParts } from "./layout_parts.js";
import { contentSize } from "./sizes.js";
import {
  adapt,
  apply,
  FarPictures,
  Following,
  initialView,
  isSame,
  isShifted,
  isView,
  operated,
  Operations,
  translate,
  unapply,
  ViewReports,
} from "./view.js";

/** @typedef {import('./view.js').Matrix} Matrix */
/** @typedef {import('./view.js').Point} Point */
/** @typedef {import('./wire.js').ViewState} ViewState */

/**
 * The services that a map needs from its page.
 *
 * @typedef {object} Surroundings
 * @property {(report: object) => void} send Sends to the server.
 * @property {(id: number) => Element | null} find The element of a mounted fragment.
 * @property {() => import('./drive.js').Drive} drive The page's connection to the gate.
 * @property {() => number | null} clock The display's clock in seconds, if known.
 */

const SVG = "http://www.w3.org/2000/svg";

/**
 * A map on the page: an `<svg>` whose world group shows metres, x right and y up.
 *
 * The browser owns the view. Programs send operations, viewers use {@link setView}; the
 * server is informed afterwards.
 */
export class MapCanvas {
  /**
   * @param {number} id The server's id of the `<svg>`.
   * @param {SVGSVGElement} svg
   * @param {SVGGElement} world
   * @param {{width: number, height: number}} size Pixels; 0 to fill the container.
   * @param {Surroundings} surroundings
   */
  constructor(id, svg, world, size, surroundings) {
    this.id = id;
    /** The root of the whole map; screen pixels. */
    this.svg = svg;
    /** The group for content in metres. */
    this.world = world;
    this._surroundings = surroundings;
    /** @type {SVGGElement | null} */
    this._overlay = null;
    /** @type {Set<(view: Matrix) => void>} */
    this._onView = new Set();
    /** @type {Set<(selected: string | null) => void>} */
    this._onSelect = new Set();
    /** @type {string | null} */
    this._selected = null;
    this._operations = new Operations();
    this._following = new Following();
    this._reports = new ViewReports(() => this._report());
    this._dragEnd = new DragEnd();
    this._session = 0;
    /** The parts of the viewer's layout that modules own. */
    this.layout = new LayoutParts();
    /** Whether the viewer chose the view, and not a program. */
    this.byHand = false;
    /** Whether the view was restored after a reconnection or a reload. */
    this.restored = false;
    this._matrix = svg.createSVGMatrix();
    this._pictures = new FarPictures(world);
    /** The robots. */
    this.crowd = new Crowd(this);

    this._setSize(size);
    this._place = placeOf(svg);
    const { width, height } = this._place;
    /** Pixels across. */
    this.width = width;
    /** Pixels down. */
    this.height = height;
    this._view = initialView(width, height);
    this._transform = world.transform.baseVal.initialize(svg.createSVGTransform());
    this._show();
    this._listen();
    this.reportSoon();
  }

  /** @param {{width: number, height: number}} size */
  _setSize({ width, height }) {
    this.svg.classList.toggle("fill", width === 0 && height === 0);
    this.svg.setAttribute("width", width > 0 ? String(width) : "100%");
    this.svg.setAttribute("height", height > 0 ? String(height) : "100%");
  }

  _listen() {
    this._ends = new AbortController();
    const { signal } = this._ends;
    const options = { capture: true, signal };
    this.svg.addEventListener("click", (event) => this._filterClick(event), options);
    this.svg.addEventListener("pointerdown", () => this._dragEnd.forget(), options);
    addEventListener("scroll", () => this.reportSoon(), { ...options, passive: true });
    this.crowd.listen(signal);
    this._observer = new ResizeObserver(() => this._resized());
    this._observer.observe(this.svg);
  }

  /** The element that contains the map. */
  get element() {
    return this.svg.parentElement;
  }

  /** A group next to the world, in pixels, for content over the map. */
  get overlay() {
    if (!this._overlay?.isConnected) {
      this._overlay = document.createElementNS(SVG, "g");
      this._overlay.classList.add("overlay");
      this.svg.append(this._overlay);
    }
    return this._overlay;
  }

  /** The page's connection to the gate; see `drive.js`. */
  get drive() {
    return this._surroundings.drive();
  }

  /**
   * The display's monotonic clock now, in seconds: for the age of anything that the
   * display has stamped. null while it is unknown.
   */
  get clock() {
    return this._surroundings.clock();
  }

  /** @returns {Matrix} From the world to the map's pixels. */
  get view() {
    return this._view;
  }

  /**
   * Set the view for the viewer; a view that is only shifted ends following.
   *
   * @param {Matrix} view
   */
  setView(view) {
    if (!isView(view) || isSame(view, this._view)) return;
    if (isShifted(view, this._view)) this._following.start(0);
    this.byHand = true;
    this._program(view);
    this.reportSoon();
  }

  /**
   * @param {(view: Matrix) => void} fn Called when the view changes.
   * @returns {() => void} Removes the listener.
   */
  onView(fn) {
    this._onView.add(fn);
    return () => this._onView.delete(fn);
  }

  /**
   * @param {number} x Pixels from the map's left.
   * @param {number} y Pixels from the map's top.
   * @returns {Point} Metres in the world.
   */
  toWorld(x, y) {
    return unapply(this._view, x, y);
  }

  /**
   * @param {number} x Metres in the world.
   * @param {number} y Metres in the world.
   * @returns {Point} Pixels from the map's left and top.
   */
  toScreen(x, y) {
    return apply(this._view, x, y);
  }

  /**
   * @param {{clientX: number, clientY: number}} event
   * @returns {Point} Its position, in pixels from the map's left and top.
   */
  pointOf(event) {
    const matrix = this.svg.getScreenCTM()?.inverse();
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix);
    return { x: point.x, y: point.y };
  }

  /**
   * @param {{clientX: number, clientY: number}} event
   * @returns {Point} Its position, in metres in the world.
   */
  worldOf(event) {
    const { x, y } = this.pointOf(event);
    return this.toWorld(x, y);
  }

  /** The robot that this viewer selected: its id at the gate, or null. */
  get selected() {
    return this._selected;
  }

  /**
   * @param {(selected: string | null) => void} fn Called when the selection changes.
   * @returns {() => void} Removes the listener.
   */
  onSelect(fn) {
    this._onSelect.add(fn);
    return () => this._onSelect.delete(fn);
  }

  /** Suppress the click that ends a drag in the browser; call at the end of a drag. */
  suppressNextClick() {
    this._dragEnd.note(performance.now());
  }

  /** @param {MouseEvent} event */
  _filterClick(event) {
    if (!this._dragEnd.swallows(event.detail, performance.now())) return;
    event.stopImmediatePropagation();
    event.preventDefault();
  }

  /** The element that the view follows, or 0. */
  get following() {
    return this._following.id;
  }

  /** @param {number} id The element to follow, or 0. */
  follow(id) {
    this._following.start(id);
    this._following.settle(this._followedPlace());
    this.reportSoon();
  }

  // For the scene --------------------------------------------------------------

  /**
   * Restore the state of the map from the server.
   *
   * @param {ViewState} state
   * @param {ViewState | undefined} kept The state on this page before the reset.
   */
  restore(state, kept) {
    this._session = state.session;
    const { applied, matrix, follow } =
      kept && kept.applied >= state.applied ? kept : state;
    this._operations.reach(applied);
    if (!matrix) return;
    this.restored = true;
    this._operations.whenSized(this._sized, () => {
      if (isView(matrix)) this._change(matrix);
      this.follow(follow);
    });
  }

  /** @returns {ViewState} */
  get state() {
    const { applied } = this._operations;
    return { session: this._session, applied, matrix: this._view, follow: this.following };
  }

  /**
   * @param {number} number Number of the operation, so that none is applied twice.
   * @param {string} operation
   * @param {number[]} args
   */
  operate(number, operation, args) {
    if (!this._operations.reach(number)) return;
    this._reports.note();
    this._operations.whenSized(this._sized, () => {
      const { view, follow } = operated(this._view, this, operation, args);
      if (follow !== undefined) this.follow(follow);
      if (view !== undefined) this._program(view);
    });
  }

  /** @param {Matrix} view */
  _program(view) {
    if (!isView(view)) return;
    this._change(view);
    this._following.settle(this._followedPlace());
  }

  /**
   * Finish a frame: update the followed view, and inform the server.
   *
   * @param {boolean} reselected Whether the selected robot may have changed.
   */
  settle(reselected) {
    this.crowd.settle();
    const shift = this._following.shift(this._followedPlace());
    if (shift) this._change(translate(this._view, shift.x, shift.y));
    if (reselected) this._checkSelection();
    this._reports.settle();
  }

  /** Stop changing the elements. */
  destroy() {
    this._ends?.abort();
    this._observer?.disconnect();
    this._pictures.end();
    this._reports.end();
    this._overlay?.remove();
    this._onView.clear();
    this._onSelect.clear();
  }

  // Private --------------------------------------------------------------------

  /** @param {Matrix} view */
  _change(view) {
    this._view = view;
    this._show();
    this.crowd.settle();
    this._reports.note();
    for (const fn of [...this._onView]) fn(view);
  }

  _show() {
    Object.assign(this._matrix, this._view);
    this._transform.setMatrix(this._matrix);
    this._pictures.show(this._view);
  }

  _resized() {
    const [before, after] = [this._place, placeOf(this.svg)];
    this._place = after;
    const { width, height } = after;
    if (before.width === width && before.height === height) return;
    Object.assign(this, { width, height });
    this._change(adapt(this._view, before, after, this.following !== 0));
    if (this._sized) this._operations.goOn();
    this._following.settle(this._followedPlace());
    this.reportSoon();
  }

  get _sized() {
    return this.width > 0 && this.height > 0;
  }

  /** @returns {Point | null} Position of the followed element, in the map's pixels. */
  _followedPlace() {
    if (!this.following) return null;
    const element = this._surroundings.find(this.following);
    if (!(element instanceof SVGGraphicsElement)) return null;
    this.crowd.draw(element);
    const matrix = element.getCTM();
    return matrix && { x: matrix.e, y: matrix.f };
  }

  _checkSelection() {
    const robot = this.world.querySelector(".robot.selected");
    const selected = robot?.getAttribute("data-robot") ?? null;
    if (selected === this._selected) return;
    this._selected = selected;
    for (const fn of [...this._onSelect]) fn(selected);
  }

  /** Report the view to the server, soon and not too often. */
  reportSoon() {
    this._reports.soon();
  }

  _report() {
    const place = this.svg.getScreenCTM();
    this._surroundings.send({
      op: "view",
      map_element: this.id,
      ...this._view,
      width: this.width,
      height: this.height,
      left: place?.e ?? 0,
      top: place?.f ?? 0,
      dpr: devicePixelRatio,
      follow: this.following,
      applied: this._operations.applied,
    });
  }
}

/**
 * @param {SVGSVGElement} svg
 * @returns {import('./view.js').Place}
 */
function placeOf(svg) {
  const { left, top } = svg.getBoundingClientRect();
  return {
    left: left + scrollX,
    top: top + scrollY,
    ...contentSize(svg),
    window: `${innerWidth} ${innerHeight}`,
  };
}

/** Most milliseconds between the end of a drag and its click. */
const CLICK_PATIENCE = 500;

/**
 * Distinguishes the click with which the browser ends a drag from a real click.
 *
 * Times are in milliseconds of one clock.
 */
export class DragEnd {
  constructor() {
    this._at = -Infinity;
  }

  /** @param {number} now Time at which a drag ended. */
  note(now) {
    this._at = now;
  }

  /** Note a new press: the next click belongs to it. */
  forget() {
    this._at = -Infinity;
  }

  /**
   * @param {number} detail Of the click: number of clicks in a row; 0 from a key.
   * @param {number} now
   * @returns {boolean} Whether the click only ends a drag.
   */
  swallows(detail, now) {
    const waited = now - this._at;
    this.forget();
    // A click without a pointer comes from a key and never ends a drag.
    return detail !== 0 && waited <= CLICK_PATIENCE;
  }
}
