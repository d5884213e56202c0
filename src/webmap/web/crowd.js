import { FarPaths, isChosen, LEAST, lookOf } from "./far_paths.js";
import { apply, scaleOf } from "./view.js";

/** @typedef {import('./far_paths.js').Box} Box */
/** @typedef {import('./far_paths.js').Look} Look */
/** @typedef {import('./item.js').Item} Item */
/** @typedef {import('./map.js').MapCanvas} MapCanvas */
/** @typedef {import('./view.js').Matrix} Matrix */
/** @typedef {import('./view.js').Point} Point */

/** With more robots on a map than this, not all of them are drawn one by one. */
export const MANY = 100;

/** Pixels below which a robot is small. */
export const SMALL = 12;

/** Pixels around the map in which robots are kept up to date. */
const MARGIN = 100;

/** Milliseconds after which a robot may be measured again, and how many may be before. */
const AGAIN = 1000;
const MOST_AGAIN = 25;

/** Milliseconds after which a robot is measured again that only has other dots. */
const DOTS_AGAIN = 5000;

/** Pixels from a small robot in which a press or a pointer means it. */
const REACH = { mouse: 8, touch: 18 };

/** A robot on a map. */
export class CrowdRobot {
  /** @param {Item} item */
  constructor(item) {
    this.item = item;
    /** @type {Box | null} Its drawing; null if nothing of it is drawn. */
    this.box = null;
    /** Whether it has dots to show that the page has not got yet. */
    this.awaits = false;
    /** Greatest distance of its drawing from its position, in metres. */
    this.reach = 0;
    /** @type {Look | null} null until it was measured. */
    this.look = null;
    this.measuredAt = -Infinity;
    /** Pixels per metre when it was measured: styles may depend on them. */
    this.scale = 0;
    this.chosen = false;
    /** Whether its newest pose is not in the document. */
    this.waits = false;
    /** Whether it is drawn together with others. */
    this.far = false;
    /** Where the document has it, in metres. */
    this.x = NaN;
    this.y = NaN;
  }

  /**
   * @param {number} scale Pixels per metre.
   * @param {number} [size] Pixels.
   * @returns {boolean} Whether something of it is drawn, and that is small.
   */
  isSmall(scale, size = SMALL) {
    const { awaits, box } = this;
    return !awaits && box !== null && Math.max(box.width, box.height) * scale < size;
  }

  /** Write the newest pose into the document. */
  draw() {
    if (this.waits) this.item.drawPlace();
    this.drawn();
  }

  /** Note that the document has the newest pose. */
  drawn() {
    this.waits = false;
    const { matrix } = this.item;
    this.x = matrix?.e ?? NaN;
    this.y = matrix?.f ?? NaN;
  }

  /** @param {boolean} far */
  setFar(far) {
    if (far === this.far) return;
    this.far = far;
    this.item.element.classList.toggle("far", far);
  }
}

/**
 * The robots of a map. As long as they are few, each is moved with each new pose.
 *
 * Of many robots, those outside the map are moved when they come into view, and those
 * that are small on the screen are drawn together: one path for each look.
 */
export class Crowd {
  /** @param {MapCanvas} map */
  constructor(map) {
    this._map = map;
    /** @type {Map<Element, CrowdRobot>} By their groups. */
    this._robots = new Map();
    /** @type {Set<CrowdRobot>} Robots to measure. */
    this._changed = new Set();
    this._paths = new FarPaths(map.world);
    this._many = false;
    /** @type {Matrix | null} The view that was drawn. */
    this._view = null;
    /** @type {CrowdRobot | null} The robot under the pointer. */
    this._held = null;
    /** @type {CrowdRobot | null} The robot that was pressed. */
    this._pressed = null;
  }

  /** @param {AbortSignal} signal */
  listen(signal) {
    const { svg } = this._map;
    const hover = (/** @type {PointerEvent} */ event) => {
      if (event.buttons === 0) this._hold(this._at(event));
    };
    svg.addEventListener("pointermove", hover, { signal, passive: true });
    svg.addEventListener("pointerleave", () => this._hold(null), { signal });
    const press = (/** @type {PointerEvent} */ event) => {
      this._pressed = this._at(event);
      this._hold(this._pressed);
    };
    svg.addEventListener("pointerdown", press, { signal, capture: true });
    svg.addEventListener("click", (event) => this._click(event), { signal, capture: true });
  }

  // The robots ---------------------------------------------------------------------

  /** @param {Item} item The group of a robot. */
  add(item) {
    const robot = new CrowdRobot(item);
    item.crowd = this;
    this._robots.set(item.element, robot);
    this._changed.add(robot);
    robot.drawn();
  }

  /** @param {Item} item */
  forget(item) {
    const robot = this._robots.get(item.element);
    if (!robot) return;
    robot.setFar(false);
    item.crowd = null;
    this._robots.delete(item.element);
    this._changed.delete(robot);
    if (this._held === robot) this._held = null;
    if (this._pressed === robot) this._pressed = null;
  }

  /**
   * @param {Item} item It has a new pose.
   * @returns {boolean} Whether {@link settle} decides when the document gets it.
   */
  defers(item) {
    const robot = this._robots.get(item.element);
    if (!robot) return false;
    robot.waits = this._many;
    if (!this._many) robot.drawn();
    return this._many;
  }

  /** @param {Element} element A robot whose drawing or looks have changed. */
  changed(element) {
    const robot = this._robots.get(element);
    if (robot) this._changed.add(robot);
  }

  /** @param {Element} element A robot with new dots, or none if it does not show them. */
  changedDots(element) {
    const robot = this._robots.get(element);
    if (!robot || robot.far) return;
    robot.draw(); // outside of the map, it was not moved
    if (robot.awaits || performance.now() - robot.measuredAt > DOTS_AGAIN) this.changed(element);
  }

  /**
   * @param {Item} item
   * @returns {boolean} Whether it is drawn together with others, or outside the map.
   */
  hides(item) {
    const robot = this._robots.get(item.element);
    return robot !== undefined && (robot.far || robot.waits);
  }

  /** Measure all robots again, because styles have changed. */
  restyle() {
    for (const robot of this._robots.values()) {
      robot.measuredAt = -Infinity;
      this._changed.add(robot);
    }
  }

  /**
   * @param {Element} element A robot.
   * @returns {Point | null} Its position in metres, also if the document does not have
   *     it yet; null if it has none.
   */
  placeOf(element) {
    const matrix = this._robots.get(element)?.item.matrix;
    return matrix ? { x: matrix.e, y: matrix.f } : null;
  }

  /** @param {Element} element Write a robot's pose into the document, to read it there. */
  draw(element) {
    this._robots.get(element)?.draw();
  }

  /** Write all poses into the document. */
  drawAll() {
    for (const robot of this._robots.values()) robot.draw();
  }

  // Drawing ------------------------------------------------------------------------

  /** Draw the new poses, and what a new view shows. */
  settle() {
    const before = this._many;
    this._many = this._robots.size > MANY;
    if (this._many) {
      this._measure(performance.now());
      this._draw();
    } else if (before) this._end();
  }

  _end() {
    for (const robot of this._robots.values()) {
      robot.setFar(false);
      robot.draw();
    }
    this._paths.begin(this._map.view, this._map, true);
    this._paths.end();
    this._view = null;
  }

  /** @param {number} now */
  _measure(now) {
    let left = MOST_AGAIN;
    const due = [...this._changed].filter(
      (robot) => now - robot.measuredAt > AGAIN || left-- > 0,
    );
    // All changes of the document come before all readings: styles are computed once.
    for (const robot of due) {
      this._changed.delete(robot);
      robot.setFar(false);
      robot.draw();
    }
    const scale = scaleOf(this._map.view);
    for (const robot of due) measure(robot, scale, now);
  }

  _draw() {
    const { view, width, height } = this._map;
    const scale = scaleOf(view);
    const seen = (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ reach) => {
      const place = apply(view, x, y);
      const room = MARGIN + reach * scale;
      const inside = place.x > -room && place.y > -room;
      return inside && place.x < width + room && place.y < height + room;
    };
    /** @type {CrowdRobot[]} */
    const small = [];
    /** @type {CrowdRobot[]} Those of their own that are smaller than the others are drawn. */
    const tiny = [];
    for (const robot of this._robots.values()) {
      const { matrix } = robot.item;
      if (!matrix || this._isNear(robot)) {
        robot.setFar(false);
        robot.draw();
        if (robot.isSmall(scale, LEAST)) tiny.push(robot);
        continue;
      }
      const inside = seen(matrix.e, matrix.f, robot.reach);
      if (inside && robot.isSmall(scale)) small.push(robot);
      else if (robot.box && (inside || seen(robot.x, robot.y, robot.reach))) {
        robot.setFar(false);
        robot.draw();
      }
    }
    this._drawSmall(small, tiny, scale);
  }

  /**
   * @param {CrowdRobot[]} small
   * @param {CrowdRobot[]} tiny Robots with their own group that are marked, too.
   * @param {number} scale
   */
  _drawSmall(small, tiny, scale) {
    const many = small.length > MANY;
    for (const robot of small) {
      // The styles of a page may keep it as large at this scale as at another.
      if (many && !robot.far && robot.scale !== scale) measure(robot, scale, performance.now());
    }
    const { view } = this._map;
    this._paths.begin(view, this._map, this._view !== view);
    this._view = view;
    for (const robot of small) {
      const { box, look } = robot;
      const { matrix } = robot.item;
      const far = many && robot.isSmall(scale);
      robot.setFar(far);
      if (!far) robot.draw();
      else if (box && look && matrix) this._paths.add(matrix, box, look);
    }
    for (const { box, look, item } of many ? tiny : []) {
      if (box && look && item.matrix) this._paths.add(item.matrix, box, look);
    }
    this._paths.end();
  }

  /** @param {CrowdRobot} robot */
  _isNear(robot) {
    const { item, look, chosen } = robot;
    return !look || chosen || robot === this._held || item.id === this._map.following;
  }

  // Pointers -----------------------------------------------------------------------

  /**
   * @param {MouseEvent} event
   * @returns {CrowdRobot | null} The small robot that is meant.
   */
  _at(event) {
    const { target } = event;
    if (!this._paths.group.isConnected || !(target instanceof Element)) return null;
    if (this._held?.item.element.contains(target)) return this._held;
    if (!this._isOn(target)) return null;
    const { x, y } = this._map.pointOf(event);
    const touched = event instanceof PointerEvent && event.pointerType === "touch";
    /** @type {CrowdRobot | null} */
    let best = null;
    let least = touched ? REACH.touch : REACH.mouse;
    for (const robot of this._robots.values()) {
      const { matrix } = robot.item;
      if (!matrix || !(robot.far || robot.chosen || robot === this._held)) continue;
      const place = apply(this._map.view, matrix.e, matrix.f);
      const distance = Math.hypot(place.x - x, place.y - y);
      if (distance >= least) continue;
      best = robot;
      least = distance;
    }
    return best;
  }

  /**
   * @param {Element} target
   * @returns {boolean} Whether it is a path of small robots, or something below them
   *     that nobody presses.
   */
  _isOn(target) {
    const { group } = this._paths;
    if (group.contains(target)) return true;
    if (target.closest("svg.webmap [tabindex], [role=button]")) return false;
    return (target.compareDocumentPosition(group) & Node.DOCUMENT_POSITION_FOLLOWING) > 0;
  }

  /** @param {CrowdRobot | null} robot Draw it by itself: its title, `:hover`, events. */
  _hold(robot) {
    if (robot === this._held) return;
    this._held = robot;
    this.settle();
  }

  /**
   * The click of a finger may miss the robot, which was drawn in its place only since.
   *
   * @param {MouseEvent} event
   */
  _click(event) {
    const robot = this._pressed;
    this._pressed = null;
    const { target } = event;
    if (!robot || (target instanceof Element && target.closest(".robot"))) return;
    event.stopImmediatePropagation();
    robot.item.element.dispatchEvent(new MouseEvent(event.type, event));
  }
}

/**
 * Read the size and the looks of a robot that is drawn by itself.
 *
 * @param {CrowdRobot} robot
 * @param {number} scale Pixels per metre.
 * @param {number} now
 */
function measure(robot, scale, now) {
  const { element } = robot.item;
  if (!(element instanceof SVGGraphicsElement)) return;
  const { x, y, width, height } = element.getBBox();
  robot.measuredAt = now;
  robot.scale = scale;
  robot.box = width > 0 || height > 0 ? { x, y, width, height } : null;
  const [across, up] = [Math.max(-x, x + width), Math.max(-y, y + height)];
  robot.reach = robot.box ? Math.hypot(across, up) : 0;
  robot.awaits = [...element.querySelectorAll(".dot")].some(
    (dot) => !dot.getAttribute("d") && dot.getClientRects().length > 0,
  );
  robot.look = lookOf(element);
  robot.chosen = isChosen(element);
}
