import { protocols } from "../key.js";

/** An attempt to connect is given up after this time, in ms. */
const OPENING_PATIENCE = 5000;

/** The first and the longest pause before connecting again, in ms. */
const PAUSE = { first: 250, longest: 5000 };

/**
 * What the link calls.
 *
 * @typedef {object} GateLinkEvents
 * @property {() => void} open
 * @property {(message: any) => void} receive One JSON object with an `op`.
 * @property {() => void} lost The connection ended or was given up.
 */

/**
 * A WebSocket that is opened again when it is lost, with growing, jittered pauses.
 *
 * No message is kept to be sent later: a late command would be wrong.
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
   * Connect if it is time for that, and give up an attempt that takes too long.
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

  /** Note that the gate answers: the next pause is short again. */
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

  /** Connect again immediately: this connection may be dead. */
  renew() {
    this._pause = PAUSE.first;
    this.lose();
    this._retryAt = 0;
  }

  /** Close, and ignore everything that still arrives on this connection. */
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
 * @returns {any} The message, or null if the data is not a message.
 */
function parse(data) {
  try {
    const message = JSON.parse(String(data));
    return typeof message?.op === "string" ? message : null;
  } catch {
    return null;
  }
}
