import { protocols, socketAddress } from "../../web/access.js";
import { FOLDER } from "../../web/constants.js";
import { html, setHidden, setText } from "../../web/tools/elements.js";

/** Pictures that wait in the decoder, above which a key picture replaces them all. */
const MANY_QUEUED = 4;

/** Most pictures that wait in the decoder. */
const MOST_QUEUED = 600;

/** Milliseconds before a lost connection is opened again. */
const WAIT = 1000;

/** Milliseconds after which the picture of a card is stale. */
const OLD = 1000;

/** The close code of a video that has ended: the display sends another address. */
const OVER = 1008;

const NOT_SECURE =
  "This browser shows video only over HTTPS: start WebMap with --tls, or choose a " +
  "camera with JPEG pictures.";
const NO_DECODER =
  "This browser cannot decode video: use another one, or choose a camera with JPEG " +
  "pictures.";

/**
 * A message with a picture, as `VideoStream` in `core/pictures.py` describes it.
 *
 * @typedef {object} Packet
 * @property {boolean} key
 * @property {number} stamp When it was sent, in seconds of the display's clock.
 * @property {string} codec Of a key picture; else empty.
 * @property {number} width Of a key picture; else 0.
 * @property {number} height
 * @property {Uint8Array} data
 */

/**
 * @param {ArrayBuffer} message
 * @returns {Packet}
 */
export function readPacket(message) {
  const view = new DataView(message);
  const key = view.getUint8(0) === 1;
  const stamp = view.getFloat64(1, true);
  if (!key) {
    return { key, stamp, codec: "", width: 0, height: 0, data: new Uint8Array(message, 9) };
  }
  const [width, height] = [view.getUint32(9, true), view.getUint32(13, true)];
  const length = view.getUint8(17);
  const codec = new TextDecoder().decode(new Uint8Array(message, 18, length));
  const data = new Uint8Array(message, 18 + length);
  return { key, stamp, codec, width, height, data };
}

/**
 * Decodes the packets of one video. After an error nothing is shown until the next key
 * picture, so that the age of the last picture grows.
 */
export class VideoDecoding {
  /**
   * @param {(frame: VideoFrame, taken: number) => void} show Gets each picture, with the
   *     time when it was sent; the picture is closed afterwards.
   * @param {(words: string) => void} say Gets what is wrong, in words.
   * @param {(init: VideoDecoderInit) => VideoDecoder} make
   */
  constructor(show, say, make = (init) => new VideoDecoder(init)) {
    this._show = show;
    this._say = say;
    this._make = make;
    /** @type {VideoDecoder | null} */
    this._decoder = null;
    this._config = "";
    this._number = 0;
    /** @type {Map<number, number>} When each picture in the decoder was sent. */
    this._taken = new Map();
  }

  /**
   * @param {Packet} packet
   * @param {number} taken When it was sent, on the clock of the page.
   */
  decode({ key, codec, width, height, data }, taken) {
    const config = `${codec} ${width} ${height}`;
    const queued = this._decoder?.decodeQueueSize ?? 0;
    const late = queued > MANY_QUEUED;
    if (key && (this._decoder === null || late || config !== this._config)) {
      this._config = config;
      this._begin(codec, width, height);
    }
    if (this._decoder === null) return;
    if (queued > MOST_QUEUED && !key) {
      this.end();
      this._say("This browser is too slow for this video: waiting for a key picture.");
      return;
    }
    const timestamp = ++this._number;
    this._taken.set(timestamp, taken);
    // A decoder that returns no picture must not fill the memory.
    this._taken.delete(timestamp - 2 * MOST_QUEUED);
    try {
      const type = key ? "key" : "delta";
      this._decoder.decode(new EncodedVideoChunk({ type, timestamp, data }));
    } catch (error) {
      this._failed(error);
    }
  }

  end() {
    if (this._decoder?.state === "configured") this._decoder.close();
    this._decoder = null;
    this._taken.clear();
  }

  /**
   * @param {string} codec
   * @param {number} codedWidth
   * @param {number} codedHeight
   */
  _begin(codec, codedWidth, codedHeight) {
    this.end();
    const decoder = this._make({
      output: (frame) => {
        if (this._decoder === decoder) this._shown(frame);
        frame.close();
      },
      error: (error) => {
        if (this._decoder === decoder) this._failed(error);
      },
    });
    this._decoder = decoder;
    try {
      decoder.configure({ codec, codedWidth, codedHeight, optimizeForLatency: true });
    } catch (error) {
      this._failed(error);
    }
  }

  /** @param {VideoFrame} frame */
  _shown(frame) {
    const taken = this._taken.get(frame.timestamp);
    this._taken.delete(frame.timestamp);
    if (taken === undefined) return;
    this._say("");
    this._show(frame, taken);
  }

  /** @param {unknown} error */
  _failed(error) {
    this.end();
    const unsupported = error instanceof DOMException && error.name === "NotSupportedError";
    this._say(
      unsupported
        ? `This browser cannot decode this video (${this._config.split(" ")[0]}): use H.264.`
        : "The browser could not decode the video: waiting for the next key picture.",
    );
  }
}

/**
 * One video in a canvas: connects to the display, decodes, draws, and connects again.
 */
export class VideoPicture {
  /**
   * @param {string} address As the display sends it.
   * @param {() => number | null} clock The clock of the display in seconds, if known.
   * @param {(taken: number) => void} [drawn] Called with the time at which the picture
   *     was sent that is in the canvas now, in milliseconds of the page's clock.
   */
  constructor(address, clock, drawn = () => {}) {
    this.address = address;
    this._clock = clock;
    this._drawn = drawn;
    this.canvas = html("canvas", "camera-image", { role: "img" });
    this._note = "";
    this._trouble = "";
    this._received = 0;
    /** @type {WebSocket | null} */
    this._socket = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this._timer = undefined;
    this._decoding = new VideoDecoding(
      (frame, taken) => this._draw(frame, taken),
      (words) => (this._trouble = words),
    );
    if (typeof VideoDecoder !== "undefined") this._open();
    else this._trouble = isSecureContext ? NO_DECODER : NOT_SECURE;
  }

  /** What a viewer should know, as a sentence; empty if all is well. */
  get words() {
    if (!this._note) return this._trouble;
    return `${this._note[0].toUpperCase()}${this._note.slice(1)}.`;
  }

  end() {
    clearTimeout(this._timer);
    const socket = this._socket;
    this._socket = null;
    // Chromium logs a warning if a socket is closed before it is open.
    if (socket?.readyState === WebSocket.CONNECTING) socket.onopen = () => socket.close();
    else socket?.close();
    this._decoding.end();
  }

  _open() {
    const url = socketAddress(this.address.replace(FOLDER, ""), {});
    const socket = new WebSocket(url, protocols());
    socket.binaryType = "arraybuffer";
    [this._socket, this._received] = [socket, 0];
    socket.addEventListener("message", ({ data }) => {
      if (this._socket === socket) this._receive(data);
    });
    socket.addEventListener("close", ({ code }) => {
      if (this._socket !== socket) return;
      this._socket = null;
      this._decoding.end();
      if (code !== OVER) this._timer = setTimeout(() => this._open(), WAIT);
    });
  }

  /** @param {ArrayBuffer | string} message */
  _receive(message) {
    if (typeof message === "string") {
      this._note = message;
      return;
    }
    // So the display notices a slow connection.
    this._socket?.send(String(++this._received));
    const [packet, clock] = [readPacket(message), this._clock()];
    const age = clock === null ? 0 : Math.max(0, 1000 * (clock - packet.stamp));
    this._decoding.decode(packet, performance.now() - age);
  }

  /**
   * @param {VideoFrame} frame
   * @param {number} taken
   */
  _draw(frame, taken) {
    const { canvas } = this;
    const { displayWidth: width, displayHeight: height } = frame;
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    canvas.getContext("2d", { alpha: false })?.drawImage(frame, 0, 0, width, height);
    this._drawn(taken);
  }
}

/** The small videos of the card, while they are in view. */
export class CardVideos {
  /** @param {() => number | null} clock */
  constructor(clock) {
    this._clock = clock;
    /** @type {Map<Element, {picture: VideoPicture, words: HTMLElement, taken: number}>} */
    this._shown = new Map();
  }

  /** Begin and end videos as their places come and go, and show what is wrong. */
  look() {
    const wanted = new Map();
    for (const place of document.querySelectorAll(".camera-video[data-video]")) {
      const large = place.closest('button[aria-pressed="true"]') !== null;
      const seen = document.visibilityState === "visible" && place.getClientRects().length;
      if (seen && !large) wanted.set(place, place.getAttribute("data-video"));
    }
    for (const [place, { picture }] of this._shown) {
      if (wanted.get(place) !== picture.address) this._end(place);
    }
    for (const [place, address] of wanted) {
      if (!this._shown.has(place)) this._begin(place, address);
    }
    for (const [place, { picture, words, taken }] of this._shown) {
      const old = performance.now() - taken > OLD;
      place.classList.toggle("stale", old);
      setText(words, picture.words || (old ? "No new picture." : ""));
      setHidden(words, words.textContent === "");
    }
  }

  destroy() {
    for (const place of [...this._shown.keys()]) this._end(place);
  }

  /**
   * @param {Element} place
   * @param {string} address
   */
  _begin(place, address) {
    const picture = new VideoPicture(address, this._clock, (taken) => (one.taken = taken));
    const words = html("span", "camera-video-words");
    const one = { picture, words, taken: performance.now() };
    this._shown.set(place, one);
    place.replaceChildren(picture.canvas, words);
  }

  /** @param {Element} place */
  _end(place) {
    this._shown.get(place)?.picture.end();
    this._shown.delete(place);
    place.replaceChildren();
  }
}
