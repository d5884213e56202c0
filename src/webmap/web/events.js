import { LONGEST_TEXTS } from "./constants.js";
import { FLAG } from "./opcodes.js";

/** @typedef {import('./item.js').Item} Item */
/** @typedef {import('./map.js').MapCanvas} MapCanvas */

/**
 * @typedef {object} Listening
 * @property {number | undefined} owner Flags, if the element's owner listens.
 * @property {number | undefined} viewer Flags, if only this page listens.
 * @property {(event: Event) => void} handler
 */

/** The events that are listened to on one element, with one DOM listener for each. */
export class Listeners {
  /**
   * @param {Item} item
   * @param {(kind: string, event: Event) => void} onEvent
   */
  constructor(item, onEvent) {
    this._item = item;
    this._onEvent = onEvent;
    /** @type {Map<string, Listening>} */
    this._kinds = new Map();
  }

  /** @param {Map<string, number>} listening The events of the element's owner. */
  setOwner(listening) {
    for (const kind of new Set([...this._kinds.keys(), ...listening.keys()])) {
      this._set(kind, { owner: listening.get(kind) });
    }
  }

  /**
   * @param {string} kind
   * @param {number | undefined} flags undefined to stop listening.
   */
  setViewer(kind, flags) {
    this._set(kind, { viewer: flags });
  }

  /** Stop listening to all events. */
  clear() {
    for (const [kind, { handler }] of this._kinds) {
      this._item.element.removeEventListener(kind, handler);
    }
    this._kinds.clear();
  }

  /**
   * @param {string} kind
   * @param {{owner?: number, viewer?: number}} change
   */
  _set(kind, change) {
    const known = this._kinds.get(kind);
    const listening = known ?? this._listen(kind);
    Object.assign(listening, change);
    if (listening.owner === undefined && listening.viewer === undefined) {
      this._item.element.removeEventListener(kind, listening.handler);
      this._kinds.delete(kind);
    }
  }

  /**
   * @param {string} kind
   * @returns {Listening}
   */
  _listen(kind) {
    /** @type {Listening} */
    const listening = {
      owner: undefined,
      viewer: undefined,
      handler: (event) => {
        const flags = (listening.owner ?? 0) | (listening.viewer ?? 0);
        if (flags & FLAG.PREVENT) event.preventDefault();
        if (flags & FLAG.STOP) event.stopPropagation();
        this._onEvent(kind, event);
      },
    };
    // Not passive: the flags may require preventDefault later.
    this._item.element.addEventListener(kind, listening.handler, { passive: false });
    this._kinds.set(kind, listening);
    return listening;
  }
}

/**
 * @param {Event} event
 * @returns {Record<string, string | number | boolean>} The description for the server,
 *     without default values.
 */
export function describe(event) {
  /** @type {Record<string, string | number | boolean>} */
  const description = {};
  if (event instanceof MouseEvent) {
    Object.assign(description, { x: event.clientX, y: event.clientY });
    if (event.button > 0) description.button = event.button;
  }
  if (event instanceof WheelEvent) description.delta = event.deltaY;
  if (event instanceof KeyboardEvent) description.key = event.key.slice(0, LONGEST_TEXTS.name);
  if (event instanceof MouseEvent || event instanceof KeyboardEvent) {
    if (event.shiftKey) description.shift = true;
    if (event.ctrlKey) description.ctrl = true;
    if (event.altKey) description.alt = true;
    if (event.metaKey) description.meta = true;
  }
  Object.assign(description, describeInput(event.currentTarget));
  return description;
}

/**
 * @param {EventTarget | null} target
 * @returns {{value?: string, checked?: boolean}}
 */
function describeInput(target) {
  if (target instanceof HTMLInputElement) {
    const value = target.value.slice(0, LONGEST_TEXTS.value);
    return { value, checked: target.checked };
  }
  if (target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement) {
    return { value: target.value.slice(0, LONGEST_TEXTS.value) };
  }
  if (target instanceof HTMLDetailsElement) return { checked: target.open };
  return {};
}

/** Of these, only the newest is sent, with a drawing of the page. */
const FREQUENT = new Set(["mousemove", "pointermove", "wheel", "input"]);

/** Milliseconds between two of these; a display with 240 Hz draws more often. */
const PERIOD = 15;

/** Sends events to the server. */
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
    this._flushed = -PERIOD;
  }

  /**
   * @param {number} mount
   * @param {Item} item
   * @param {string} kind
   * @param {Event} event
   */
  report(mount, item, kind, event) {
    const description = { op: "event", mount, element: item.id, event: kind, ...describe(event) };
    const message = { ...description, ...this._whereabouts(item, event) };
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
    if (this._waiting.size === 0) this._flushSoon();
    const before = this._waiting.get(key);
    if (before?.delta !== undefined) message.delta += before.delta;
    this._waiting.set(key, message);
  }

  _flushSoon() {
    requestAnimationFrame((now) => {
      if (now - this._flushed < PERIOD) return this._flushSoon();
      this._flushed = now;
      this._flush();
    });
  }

  _flush() {
    for (const message of this._waiting.values()) this._send(message);
    this._waiting.clear();
  }
}
