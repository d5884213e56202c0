import { protocols } from "../key.js";

/** A connection that does not open within this time is given up, in ms. */
const OPENING_PATIENCE = 5000;

/** The first and the longest pause before connecting again, in ms. */
const PAUSE = { first: 250, longest: 5000 };

/**
 * What a line tells its owner.
 *
 * @typedef {object} GateLinkEvents
 * @property {() => void} open
 * @property {(message: any) => void} receive One JSON object with an `op`.
 * @property {() => void} lost The connection ended or was given up.
 */

/**
 * A WebSocket that is opened again when it is lost, with growing, jittered pauses.
 *
 * Nothing is ever kept to be sent later: a command is for now or not at all.
 */
export class GateLink {
  /**
   * @param {URL} url
   * @param {GateLinkEvents} events
   */
  constructor(url, events) {
    this._url = url;
    this._events = events;
    /** @type {WebSocket | null} */
    this._socket = null;
    this._since = 0;
    this._retryAt = 0;
    this._pause = PAUSE.first;
  }

  /** Whether messages can be sent. */
  get open() {
    return this._socket?.readyState === WebSocket.OPEN;
  }

  /**
   * Open a connection when it is time to, and give up one that does not come about.
   *
   * @param {number} now
   */
  mind(now) {
    if (this._socket === null) {
      if (now >= this._retryAt) this._connect(now);
    } else if (!this.open && now - this._since > OPENING_PATIENCE) {
      this.lose();
    }
  }

  /** The other side is really there: the next pause is a short one again. */
  trust() {
    this._pause = PAUSE.first;
  }

  /** @param {object} message */
  send(message) {
    if (this.open) this._socket?.send(JSON.stringify(message));
  }

  /** Give this connection up; {@link GateLink#mind} opens another after a pause. */
  lose() {
    this.abandon();
    this._retryAt = performance.now() + this._pause * (0.5 + Math.random() / 2);
    this._pause = Math.min(this._pause * 2, PAUSE.longest);
    this._events.lost();
  }

  /** Connect again at once: this connection has died unnoticed. */
  renew() {
    this._pause = PAUSE.first;
    this.lose();
    this._retryAt = 0;
  }

  /** Close, and hear nothing any more from a connection that may linger. */
  abandon() {
    const socket = this._socket;
    this._socket = null;
    if (!socket) return;
    socket.onopen = socket.onclose = socket.onmessage = null;
    socket.close();
  }

  /** @param {number} now */
  _connect(now) {
    const socket = new WebSocket(this._url, protocols());
    this._socket = socket;
    this._since = now;
    socket.onopen = () => this._events.open();
    socket.onclose = () => this.lose();
    socket.onmessage = (event) => {
      const message = parse(event.data);
      if (message !== null) this._events.receive(message);
    };
  }
}

/**
 * @param {unknown} data
 * @returns {any} The message, or null for what is none.
 */
function parse(data) {
  try {
    const message = JSON.parse(String(data));
    return typeof message?.op === "string" ? message : null;
  } catch {
    return null;
  }
}
