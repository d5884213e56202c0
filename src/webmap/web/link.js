/** The two sockets of a page: that of the display with the picture, and that of the gate. */

import { FOR_GOOD } from "./constants.js";
import { onSignIn, protocols } from "./access.js";
import { isPacked, unpacked } from "./packed.js";

/** Milliseconds before a lost connection is opened again: first and longest wait. */
const FIRST_WAIT = 250;
const LONGEST_WAIT = 5000;
/** Milliseconds in which a connection must open: first and longest limit. */
const FIRST_PATIENCE = 5000;
const LONGEST_PATIENCE = 20_000;

/**
 * @typedef {object} LinkEvents
 * @property {() => void} opened
 * @property {(data: ArrayBuffer, at: number) => void} received With the time at which
 *     it came, by `performance.now()`.
 * @property {(reason: string, forGood: boolean) => void} closed
 * @property {() => void} refused It did not open; `closed` has been called.
 */

/**
 * @typedef {object} FirstSocket
 * @property {WebSocket} socket
 * @property {Array<{data: Promise<ArrayBuffer>, at: number}>} received The messages that
 *     have come, decompressed, with the times of `performance.now()`.
 */

/** A WebSocket that reconnects; a message without a connection is dropped. */
export class Link {
  /**
   * @param {() => URL} address
   * @param {LinkEvents} events
   * @param {FirstSocket} [first] A socket that was opened before.
   */
  constructor(address, events, first) {
    this._address = address;
    this._events = events;
    this._wait = FIRST_WAIT;
    /** When opening started. */
    this._since = 0;
    this._patience = FIRST_PATIENCE;
    /** @type {WebSocket | null} */
    this._socket = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this._timer = undefined;
    onSignIn(() => this._hurry());
    addEventListener("online", () => this._hurry());
    if (first && first.socket.readyState <= WebSocket.OPEN) this._adopt(first);
    else this._open();
  }

  get isOpen() {
    return this._socket?.readyState === WebSocket.OPEN;
  }

  /** Whether it is being opened. */
  get opens() {
    return this._socket?.readyState === WebSocket.CONNECTING;
  }

  /** Give up a connection that takes too long to open, and try again. */
  look() {
    if (!this.opens || performance.now() - this._since < this._patience) return;
    // A slow network gets more time at each attempt.
    this._patience = Math.min(this._patience * 2, LONGEST_PATIENCE);
    this.renew();
  }

  /** @param {object} message Sent now or not at all. */
  send(message) {
    if (this.isOpen) this._socket?.send(JSON.stringify(message));
  }

  /** The server works: after the next loss, reconnect immediately. */
  settle() {
    this._wait = FIRST_WAIT;
    this._patience = FIRST_PATIENCE;
  }

  /** Close the connection and open a new one. */
  renew() {
    const socket = this._socket;
    if (!socket) return;
    // A dead connection takes long to close: do not wait for it.
    this._lost(socket, "no answer", 1006);
    socket.close();
  }

  /** Close the connection permanently. */
  end() {
    const socket = this._socket;
    this._socket = null;
    socket?.close();
    this._events.closed("", true);
  }

  _open() {
    this._timer = undefined;
    const socket = new WebSocket(this._address(), protocols());
    socket.binaryType = "arraybuffer";
    this._listen(socket);
  }

  /** @param {FirstSocket} first */
  _adopt({ socket, received }) {
    const hear = this._listen(socket);
    if (socket.readyState !== WebSocket.OPEN) return;
    // Events come after the constructor, as those of a new socket.
    queueMicrotask(() => {
      hear.open();
      for (const { data, at } of received) hear.inTurn(data, at);
    });
  }

  /** @param {WebSocket} socket */
  _listen(socket) {
    this._since = performance.now();
    this._socket = socket;
    let opened = false;
    const open = () => {
      opened = true;
      this._events.opened();
    };
    /** @type {Promise<void> | null} Of the last message, if it waits. */
    let last = null;
    /**
     * @param {ArrayBuffer} frame
     * @param {number} at
     */
    const deliver = (frame, at) => {
      if (this._socket === socket) this._events.received(frame, at);
    };
    /**
     * Messages that come meanwhile wait, so that all stay in order.
     *
     * @param {Promise<ArrayBuffer>} data
     * @param {number} at
     */
    const inTurn = (data, at) => {
      const mine = Promise.all([data, last]).then(([frame]) => {
        if (last === mine) last = null;
        deliver(frame, at);
      });
      last = mine;
    };
    socket.addEventListener("open", open);
    socket.addEventListener("message", ({ data }) => {
      if (!(data instanceof ArrayBuffer)) return;
      if (last || isPacked(data)) inTurn(unpacked(data), performance.now());
      else deliver(data, performance.now());
    });
    socket.addEventListener("close", ({ code, reason }) => {
      const current = this._socket === socket;
      this._lost(socket, reason, code);
      if (current && !opened) this._events.refused();
    });
    return { open, inTurn };
  }

  /**
   * @param {WebSocket} socket
   * @param {string} reason
   * @param {number} code
   */
  _lost(socket, reason, code) {
    if (this._socket !== socket) return;
    this._socket = null;
    const forGood = FOR_GOOD.includes(code);
    if (!forGood) {
      const jitter = 0.75 + Math.random() / 2;
      this._timer = setTimeout(() => this._open(), this._wait * jitter);
      this._wait = Math.min(this._wait * 2, LONGEST_WAIT);
    }
    this._events.closed(reason, forGood);
  }

  _hurry() {
    // A connection that was started on another network may never open.
    if (this.opens) this.renew();
    if (this._timer === undefined) return;
    clearTimeout(this._timer);
    this._open();
  }
}

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
