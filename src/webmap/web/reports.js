import { describe } from "./events.js";

/** @typedef {import('./item.js').Item} Item */
/** @typedef {import('./map.js').MapCanvas} MapCanvas */

/** Of these only the newest is told, once for each time that the page is drawn. */
const FREQUENT = new Set(["mousemove", "pointermove", "wheel", "input"]);

/** Tells the server of events. */
export class Reports {
  /**
   * @param {(message: object) => void} send
   * @param {(node: Node) => MapCanvas | undefined} mapOf
   */
  constructor(send, mapOf) {
    this._send = send;
    this._mapOf = mapOf;
    /** @type {Map<string, Record<string, any>>} */
    this._waiting = new Map();
  }

  /**
   * @param {number} mount
   * @param {Item} item
   * @param {string} kind
   * @param {Event} event
   */
  hear(mount, item, kind, event) {
    const told = { op: "event", mount, element: item.id, event: kind, ...describe(event) };
    const message = { ...told, ...this._whereabouts(item, event) };
    if (FREQUENT.has(kind)) {
      this._keep(`${mount} ${item.id} ${kind}`, message);
    } else {
      this._flush();
      this._send(message);
    }
  }

  /**
   * @param {Item} item
   * @param {Event} event
   */
  _whereabouts(item, event) {
    const canvas = event instanceof MouseEvent && this._mapOf(item.element);
    if (!canvas) return {};
    const { x, y } = canvas.pointOf(event);
    const world = canvas.toWorld(x, y);
    return { x, y, world_x: world.x, world_y: world.y };
  }

  /**
   * @param {string} key
   * @param {Record<string, any>} message
   */
  _keep(key, message) {
    if (this._waiting.size === 0) requestAnimationFrame(() => this._flush());
    const before = this._waiting.get(key);
    if (before?.delta !== undefined) message.delta += before.delta;
    this._waiting.set(key, message);
  }

  _flush() {
    for (const message of this._waiting.values()) this._send(message);
    this._waiting.clear();
  }
}
