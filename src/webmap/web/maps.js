import { MapCanvas } from "./map.js";

/** @typedef {import('./item.js').Item} Item */
/** @typedef {import('./map.js').Surroundings} Surroundings */
/** @typedef {import('./mount.js').Mount} Mount */
/** @typedef {import('./wire.js').ViewState} ViewState */

/**
 * @typedef {object} Place
 * @property {Mount} mount
 * @property {Item} item The `<svg>`.
 * @property {number} world The id of the world group.
 * @property {{width: number, height: number}} size
 * @property {MapCanvas | null} canvas null until the world exists.
 */

/** The maps on the page. */
export class Maps {
  /**
   * @param {(svg: Element) => Surroundings} surroundings
   * @param {(canvas: MapCanvas) => void} onEnd Called before a map is removed.
   */
  constructor(surroundings, onEnd) {
    this._surroundings = surroundings;
    this._onEnd = onEnd;
    /** @type {Map<number, Place>} */
    this._places = new Map();
    /** @type {Map<string, ViewState>} Views of removed maps, to restore them. */
    this._kept = new Map();
  }

  /** @returns {MapCanvas[]} */
  get all() {
    return [...this._places.values()].flatMap(({ canvas }) => canvas ?? []);
  }

  /**
   * @param {Mount} mount
   * @param {Item} item The `<svg>`.
   * @param {number} world The id of the world group.
   * @param {{width: number, height: number}} size Pixels; 0 to fill the container.
   */
  add(mount, item, world, size) {
    this.end(item);
    this._places.set(item.id, { mount, item, world, size, canvas: null });
  }

  /**
   * @param {number} svg
   * @returns {MapCanvas | null} The map, made as soon as its elements exist.
   */
  get(svg) {
    const place = this._places.get(svg);
    if (!place) return null;
    place.canvas ??= this._make(svg, place);
    return place.canvas;
  }

  /**
   * @param {number} id
   * @param {Place} place
   */
  _make(id, { mount, item, world, size }) {
    const svg = item.element;
    const group = mount.items.get(world)?.element;
    if (!(svg instanceof SVGSVGElement && group instanceof SVGGElement)) return null;
    return new MapCanvas(id, svg, group, size, this._surroundings(svg));
  }

  /**
   * @param {number} svg
   * @param {ViewState} state
   */
  restore(svg, state) {
    const key = `${state.session} ${svg}`;
    this.get(svg)?.restore(state, this._kept.get(key));
    this._kept.delete(key);
  }

  /** @param {boolean} reselected Whether the selected robot may have changed. */
  settle(reselected) {
    for (const svg of this._places.keys()) this.get(svg)?.settle(reselected);
  }

  /** Draw the robots again whose looks have changed. */
  settleRobots() {
    for (const { crowd } of this.all) crowd.settle();
  }

  /** @param {Item} item An item that is removed and may be a map. */
  end(item) {
    const place = this._places.get(item.id);
    if (place?.item !== item) return;
    this._places.delete(item.id);
    const { canvas } = place;
    if (!canvas) return;
    this._kept.set(`${canvas.state.session} ${item.id}`, canvas.state);
    this._onEnd(canvas);
    canvas.destroy();
  }
}
