import { BASE } from "./access.js";
import { Ages, DisplayClock } from "./ages.js";
import { MOST_UNSEEN } from "./constants.js";
import { Listeners } from "./events.js";
import { BoundItem, Dots } from "./item.js";
import { Maps } from "./maps.js";
import { Mount } from "./mount.js";
import { onBeat } from "./tools/elements.js";
import { readFrame } from "./wire.js";

/** @typedef {import('./item.js').Item} Item */
/** @typedef {import('./map.js').MapCanvas} MapCanvas */
/** @typedef {import('./wire.js').Matrix} Matrix */
/** @typedef {import('./wire.js').Sink} Sink */
/** @typedef {import('./wire.js').ViewState} ViewState */

/** Most images that cannot be loaded and are reported. */
const MOST_LOST = 20;

/**
 * The services that the scene needs from its page.
 *
 * @typedef {object} ScenePage
 * @property {(message: object) => void} send Sends to the server.
 * @property {(text: string) => void} notice Shows to the viewer, sends to the server.
 * @property {(text: string) => void} error Shows an error of the server.
 * @property {(number: number, text: string) => void} problem Shows a problem until it
 *     is solved; an empty text means solved.
 * @property {() => void} recheckProblems All unsolved problems are reported again now.
 * @property {(mount: number, item: Item, kind: string, event: Event) => void} onEvent
 *     Handles an event.
 * @property {() => import('./drive.js').Drive} drive The page's connection to the gate.
 * @property {Pick<import('./browser_parts.js').BrowserParts,
 *     "attach" | "detach" | "detachFrom" | "receive">} parts
 * @property {Document | ShadowRoot} root Contains the page's own elements.
 * @property {HTMLElement} body Contains what Python appends to the page.
 */

/**
 * The scene on this page: applies complete frames to the document.
 *
 * @implements {Sink}
 */
export class Scene {
  /** @param {ScenePage} page */
  constructor(page) {
    this._page = page;
    // Before the ages are written: then the browser need not compute a layout for it.
    this._endLooks = onBeat(() => this._reportUnseen());
    this._clock = new DisplayClock();
    this._ages = new Ages(this._clock, () => this._restale());
    this._dots = new Dots();
    this._maps = new Maps(
      (svg) => this._surroundings(svg),
      (canvas) => page.parts.detachFrom(canvas),
    );
    /** @type {Map<number, Mount>} */
    this._mounts = new Map();
    /** @type {Map<number, Set<Mount>>} The mounts of each fragment. */
    this._fragments = new Map();
    /** @type {Iterable<Mount>} The mounts that records of elements apply to. */
    this._targets = [];
    /** @type {WeakMap<Item, Listeners>} */
    this._listeners = new WeakMap();
    /** @type {WeakMap<Mount, Map<number, Map<string, number>>>} */
    this._listening = new WeakMap();
    this._reselected = false;
    /** @type {Set<Item>} Groups of robots that no map has yet. */
    this._arrived = new Set();
    this._onGone = this._onGone.bind(this);
    /** @type {Set<string>} Paths of images that could not be loaded. */
    this._lost = new Set();
    this._unseen = "";
    // Such an error does not bubble, but it can be captured.
    page.root.addEventListener("error", ({ target }) => this._onLost(target), true);
  }

  /** Remove everything from the page; no frame may be applied afterwards. */
  end() {
    this._clear();
    this._ages.stop();
    this._endLooks();
  }

  /** Send which dots are not shown, such as those of a layer that is off. */
  _reportUnseen() {
    const elements = this._dots.unseen().slice(0, MOST_UNSEEN);
    const unseen = elements.join();
    if (unseen === this._unseen) return;
    this._unseen = unseen;
    this._page.send({ op: "unseen", elements });
  }

  /** @param {EventTarget | null} target An element that could not be loaded. */
  _onLost(target) {
    if (!(target instanceof SVGImageElement) || !this.mapOf(target)) return;
    const { href, pathname } = new URL(target.getAttribute("href") ?? "", document.baseURI);
    // WebMap's own images may have a newer version soon; their layers handle errors.
    if (href.startsWith(BASE.href) || this._lost.has(pathname)) return;
    if (this._lost.size >= MOST_LOST) return;
    this._lost.add(pathname);
    this._page.notice(`The image ${pathname} could not be loaded.`);
  }

  /**
   * @param {ArrayBuffer} buffer One frame.
   * @param {number} received This page's clock when it came, in seconds.
   * @returns {number} The number of the frame.
   */
  apply(buffer, received) {
    const header = readFrame(buffer, ({ reset, now }) => {
      if (reset) this._clear();
      this._clock.update(now, received);
      return this;
    });
    this._targets = [];
    this._gather();
    // Maps are made after all their elements exist, with their final size.
    this._maps.settle(this._reselected);
    this._reselected = false;
    this._dots.draw();
    this._ages.flush();
    return header.frame;
  }

  /** Clear everything: it is sent again, perhaps by a server with another clock. */
  _clear() {
    for (const mount of [...this._mounts.values()].reverse()) this.unmount(mount.id);
    this._targets = [];
    this._unseen = "";
    this._clock.reset();
    this._page.recheckProblems();
  }

  /** Note that styles may have changed. */
  restyle() {
    for (const { crowd } of this.maps) crowd.restyle();
    this._restale();
  }

  /** Note that data became stale or fresh, which may have other styles. */
  _restale() {
    this._dots.restyle();
    queueMicrotask(() => {
      this._maps.settleRobots();
      this._dots.draw();
    });
  }

  /** Give robots to their maps. */
  _gather() {
    for (const item of this._arrived) {
      const robots = item.element.parentElement;
      const map = this.maps.find(({ world }) => world === robots?.parentNode);
      if (!map || !robots?.classList.contains("robots")) continue;
      map.crowd.add(item);
      this._arrived.delete(item);
    }
  }

  /** Note that the drawing of the robots changes that the records apply to. */
  _redraw() {
    for (const { root } of this._targets) root?.crowd?.changed(root.element);
  }

  /** @returns {MapCanvas[]} The maps on the page. */
  get maps() {
    return this._maps.all;
  }

  /**
   * @param {Node} node
   * @returns {MapCanvas | undefined} The map that contains a node.
   */
  mapOf(node) {
    return this.maps.find(({ svg }) => svg.contains(node));
  }

  /** @param {Element} svg */
  _surroundings(svg) {
    this._reselected = true;
    return {
      send: (/** @type {object} */ report) => this._page.send(report),
      find: (/** @type {number} */ id) => this._find(svg, id),
      drive: () => this._page.drive(),
      clock: () => this._clock.at(performance.now() / 1000),
    };
  }

  /**
   * @param {Element} svg
   * @param {number} id
   * @returns {Element | null}
   */
  _find(svg, id) {
    for (const { items } of this._mounts.values()) {
      const element = items.get(id)?.element;
      if (element && svg.contains(element)) return element;
    }
    return null;
  }

  /** @param {Item} item An item to remove, with its state. */
  _onGone(item) {
    this._maps.end(item);
    this._ages.forget(item);
    this._dots.forget(item);
    this._listeners.get(item)?.clear();
    item.crowd?.forget(item);
    this._arrived.delete(item);
  }

  // Records about the page -----------------------------------------------------

  /** @param {number} fragment */
  delta(fragment) {
    this._targets = this._fragments.get(fragment) ?? [];
  }

  /** @param {number} mount */
  snapshot(mount) {
    const known = this._mounts.get(mount);
    this._targets = known ? [known] : [];
  }

  /**
   * @param {number} id
   * @param {number} fragment
   * @param {number} within
   * @param {number} under
   * @param {number} order
   */
  mount(id, fragment, within, under, order) {
    const mount = new Mount(id, fragment, this._mounts.get(within) ?? null, under, order);
    this._mounts.set(id, mount);
    const mounts = this._fragments.get(fragment) ?? new Set();
    this._fragments.set(fragment, mounts.add(mount));
  }

  /** @param {number} id */
  unmount(id) {
    const mount = this._mounts.get(id);
    if (!mount) return;
    mount.removeRoot(this._onGone);
    mount.leave();
    this._mounts.delete(id);
    const mounts = this._fragments.get(mount.fragment);
    mounts?.delete(mount);
    if (mounts?.size === 0) this._fragments.delete(mount.fragment);
    this._reselected = true;
  }

  /**
   * @param {number} id
   * @param {boolean} on
   * @param {string} name
   */
  mountClass(id, on, name) {
    const root = this._mounts.get(id)?.root;
    root?.element.classList.toggle(name, on);
    root?.crowd?.changed(root.element);
    this._dots.restyle();
    this._reselected = true;
  }

  /**
   * @param {number} id
   * @param {number} element
   * @param {string} kind
   */
  unlisten(id, element, kind) {
    this.listen(id, element, kind, undefined);
  }

  /**
   * @param {number} id
   * @param {number} element
   * @param {string} kind
   * @param {number | undefined} flags undefined to stop listening.
   */
  listen(id, element, kind, flags) {
    const mount = this._mounts.get(id);
    if (!mount) return;
    // Kept separately, for a new element with the same id.
    const listening = this._listening.get(mount) ?? new Map();
    this._listening.set(mount, listening);
    const kinds = listening.get(element) ?? new Map();
    if (flags === undefined) kinds.delete(kind);
    else kinds.set(kind, flags);
    if (kinds.size > 0) listening.set(element, kinds);
    else listening.delete(element);
    const item = mount.items.get(element);
    if (item) this._listenersOf(mount, item).setViewer(kind, flags);
  }

  /**
   * @param {Mount} mount
   * @param {Item} item
   * @returns {Listeners}
   */
  _listenersOf(mount, item) {
    const known = this._listeners.get(item);
    if (known) return known;
    const { id } = mount;
    const listeners = new Listeners(item, (kind, event) =>
      this._page.onEvent(id, item, kind, event),
    );
    this._listeners.set(item, listeners);
    return listeners;
  }

  /** @param {string} text */
  error(text) {
    this._page.error(text);
  }

  /**
   * @param {number} number
   * @param {string} text
   */
  problem(number, text) {
    this._page.problem(number, text);
  }

  // Records about maps and modules ---------------------------------------------

  /**
   * @param {number} svg
   * @param {ViewState} state
   */
  viewState(svg, state) {
    this._maps.restore(svg, state);
  }

  /**
   * @param {number} svg
   * @param {number} number
   * @param {string} operation
   * @param {number[]} args
   */
  view(svg, number, operation, args) {
    this._maps.get(svg)?.operate(number, operation, args);
  }

  /**
   * @param {number} svg
   * @param {number} instance
   * @param {string} module
   * @param {string} css
   * @param {unknown} options
   */
  attach(svg, instance, module, css, options) {
    const canvas = this._maps.get(svg);
    if (canvas) this._page.parts.attach(canvas, instance, module, css, options);
  }

  /** @param {number} instance */
  detach(instance) {
    this._page.parts.detach(instance);
  }

  /**
   * @param {number} instance
   * @param {unknown} message
   */
  message(instance, message) {
    this._page.parts.receive(instance, message);
  }

  // Records about elements -----------------------------------------------------

  /**
   * @param {number} id
   * @param {number} parent
   * @param {number} place
   * @param {string} tag
   * @param {boolean} svg
   */
  create(id, parent, place, tag, svg) {
    for (const mount of this._targets) {
      const item = mount.create(id, parent, place, tag, svg);
      mount.root?.crowd?.changed(mount.root.element);
      const listening = item && this._listening.get(mount)?.get(id);
      if (!listening) continue;
      for (const [kind, flags] of listening) {
        this._listenersOf(mount, item).setViewer(kind, flags);
      }
    }
  }

  /**
   * @param {number} id
   * @param {number} parent
   * @param {number} place
   * @param {string} data
   */
  text(id, parent, place, data) {
    for (const mount of this._targets) mount.createText(id, parent, place, data);
  }

  /** @param {number} id */
  document(id) {
    for (const mount of this._targets) mount.createDocument(id, this._page.body);
  }

  /**
   * @param {number} id
   * @param {string} htmlId
   */
  bind(id, htmlId) {
    const found = this._page.root.getElementById(htmlId);
    if (!found) this._page.notice(`This page has no element with the id "${htmlId}".`);
    // A missing element is replaced by an invisible one.
    const element = found ?? document.createElement("div");
    for (const mount of this._targets) mount.bind(id, element);
  }

  /** @param {number} id */
  remove(id) {
    for (const mount of this._targets) mount.remove(id, this._onGone);
    this._redraw();
  }

  /**
   * @param {number} id
   * @param {(item: Item, mount: Mount) => void} fn
   */
  _each(id, fn) {
    for (const mount of this._targets) {
      const item = mount.items.get(id);
      if (item) fn(item, mount);
    }
  }

  /**
   * @param {number} id
   * @param {string} name
   * @param {string | null} value
   */
  attribute(id, name, value) {
    this._each(id, (item) => {
      try {
        item.setAttribute(name, value);
      } catch (error) {
        this._page.notice(`${name} of ${item.element.tagName} cannot be set: ${error}`);
      }
    });
    this._redraw();
  }

  /**
   * @param {number} id
   * @param {string} classes
   */
  classes(id, classes) {
    this._each(id, (item, mount) => {
      item.setClasses(classes);
      for (const { svg, crowd } of this.maps) if (item.element.contains(svg)) crowd.restyle();
      if (item === mount.root && !item.crowd && item.element.classList.contains("robot")) {
        this._arrived.add(item);
      }
    });
    this._restyle(id);
    this._reselected = true;
  }

  /**
   * @param {number} id
   * @param {string} name
   * @param {string} value
   */
  style(id, name, value) {
    this._each(id, (item) => item.setStyle(name, value));
    this._restyle(id);
  }

  /**
   * Note a new look of an element. The dots in it may have another size then; an element
   * that is new, or is empty, has none.
   *
   * @param {number} id
   */
  _restyle(id) {
    this._redraw();
    this._each(id, (item) => {
      if (item.element.firstElementChild || this._dots.has(item)) this._dots.restyle();
    });
  }

  /**
   * @param {number} id
   * @param {number} x
   * @param {number} y
   * @param {number} yaw
   */
  pose(id, x, y, yaw) {
    this._each(id, (item) => item.setPose(x, y, yaw));
  }

  /**
   * @param {number} id
   * @param {Matrix} matrix
   */
  matrix(id, matrix) {
    this._each(id, (item, { root }) => {
      item.setMatrix(matrix);
      if (item !== root) root?.crowd?.changed(root.element);
    });
  }

  /**
   * @param {number} id
   * @param {number} unit
   * @param {Int16Array} points
   */
  dots(id, unit, points) {
    this._each(id, (item, { root }) => {
      this._dots.set(item, unit, points);
      root?.crowd?.changedDots(root.element);
    });
  }

  /**
   * @param {number} id
   * @param {number} total
   * @param {number[]} points
   */
  line(id, total, points) {
    this._each(id, (item) => item.setLine(total, points));
    this._redraw();
  }

  /**
   * @param {number} id
   * @param {number | null} measured
   */
  age(id, measured) {
    this._each(id, (item) => this._ages.set(item, measured));
  }

  /**
   * @param {number} id
   * @param {number} limit
   * @param {boolean} shown
   */
  ageLimit(id, limit, shown) {
    this._each(id, (item) => this._ages.limit(item, limit, shown));
  }

  /**
   * @param {number} id
   * @param {string} data
   */
  data(id, data) {
    for (const mount of this._targets) mount.setText(id, data);
    this._redraw();
  }

  /**
   * @param {number} id
   * @param {Map<string, number>} listening
   */
  events(id, listening) {
    this._each(id, (item, mount) => this._listenersOf(mount, item).setOwner(listening));
  }

  /** @param {number} id */
  empty(id) {
    this._each(id, (item) => {
      if (item instanceof BoundItem) item.empty();
    });
  }

  /**
   * @param {number} id
   * @param {number} world
   * @param {number} width
   * @param {number} height
   */
  map(id, world, width, height) {
    this._each(id, (item, mount) => this._maps.add(mount, item, world, { width, height }));
  }
}
