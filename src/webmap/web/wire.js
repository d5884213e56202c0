import {
  ATTRIBUTES,
  EVENTS,
  FLAG,
  HTML_TAGS,
  OP,
  SVG_TAGS,
  VERSION,
  VIEW_OPERATIONS,
} from "./opcodes.js";
import { rays } from "./rays.js";

/**
 * Receives the records of a frame, one by one; see `webmap/scene/wire/opcodes.py`.
 *
 * @typedef {object} Sink
 * @property {(fragment: number) => void} delta
 * @property {(mount: number) => void} snapshot
 * @property {(mount: number, fragment: number, within: number, under: number,
 *     order: number) => void} mount
 * @property {(mount: number) => void} unmount
 * @property {(mount: number, on: boolean, name: string) => void} mountClass
 * @property {(mount: number, element: number, kind: string, flags: number) => void}
 *     listen
 * @property {(mount: number, element: number, kind: string) => void} unlisten
 * @property {(svg: number, state: ViewState) => void} viewState
 * @property {(svg: number, number: number, operation: string, args: number[]) => void}
 *     view
 * @property {(svg: number, instance: number, module: string, css: string,
 *     options: unknown) => void} attach
 * @property {(instance: number) => void} detach
 * @property {(instance: number, message: unknown) => void} message
 * @property {(text: string) => void} error
 * @property {(number: number, text: string) => void} problem
 * @property {(id: number, parent: number, place: number, tag: string,
 *     svg: boolean) => void} create
 * @property {(id: number, parent: number, place: number, data: string) => void} text
 * @property {(id: number) => void} document
 * @property {(id: number, htmlId: string) => void} bind
 * @property {(id: number) => void} remove
 * @property {(id: number, name: string, value: string | null) => void} attribute
 * @property {(id: number, classes: string) => void} classes
 * @property {(id: number, name: string, value: string) => void} style
 * @property {(id: number, x: number, y: number, yaw: number) => void} pose
 * @property {(id: number, matrix: Matrix) => void} matrix
 * @property {(id: number, unit: number, points: Int16Array) => void} dots
 * @property {(id: number, total: number, points: number[]) => void} line
 * @property {(id: number, measured: number | null) => void} age
 * @property {(id: number, limit: number, shown: boolean) => void} ageLimit
 * @property {(id: number, data: string) => void} data
 * @property {(id: number, listening: Map<string, number>) => void} events
 * @property {(id: number) => void} empty
 * @property {(id: number, world: number, width: number, height: number) => void} map
 */

/** @typedef {import('./view.js').Matrix} Matrix */

/**
 * The last view of a map.
 *
 * @typedef {object} ViewState
 * @property {number} session The server session of the numbers.
 * @property {number} applied The newest operation that is part of `matrix`.
 * @property {Matrix | null} matrix From the world to the map's pixels, if known.
 * @property {number} follow The element that the view followed, or 0.
 */

/**
 * @typedef {object} Header
 * @property {boolean} reset Whether the frame is complete and replaces everything.
 * @property {number} frame The number to acknowledge.
 * @property {number} now The display's monotonic clock, in seconds.
 */

/** Bytes that are not a frame, or a frame of another version. */
export class WireError extends Error {}

/** A frame of another version: this page is older or newer than the server. */
export class VersionError extends WireError {}

const decoder = new TextDecoder();

/** Reads one frame from its bytes. */
export class Reader {
  /** @param {ArrayBuffer} buffer */
  constructor(buffer) {
    this._view = new DataView(buffer);
    this._bytes = new Uint8Array(buffer);
    this._at = 0;
  }

  get done() {
    return this._at >= this._bytes.length;
  }

  get at() {
    return this._at;
  }

  u8() {
    return this._view.getUint8(this._at++);
  }

  u16() {
    this._at += 2;
    return this._view.getUint16(this._at - 2, true);
  }

  u32() {
    this._at += 4;
    return this._view.getUint32(this._at - 4, true);
  }

  f32() {
    this._at += 4;
    return this._view.getFloat32(this._at - 4, true);
  }

  f64() {
    this._at += 8;
    return this._view.getFloat64(this._at - 8, true);
  }

  /** Numbers up to 2 ** 53, so they are not shifted. */
  varint() {
    let byte = this.u8();
    let number = byte & 0x7f;
    for (let factor = 0x80; byte > 0x7f; factor *= 0x80) {
      byte = this.u8();
      number += (byte & 0x7f) * factor;
    }
    if (number > Number.MAX_SAFE_INTEGER) throw new WireError("a number is too large");
    return number;
  }

  string() {
    const length = this.varint();
    this._need(length);
    this._at += length;
    return decoder.decode(this._bytes.subarray(this._at - length, this._at));
  }

  json() {
    try {
      return JSON.parse(this.string());
    } catch (error) {
      throw new WireError(`expected JSON: ${error}`);
    }
  }

  /** @param {number} count */
  i16s(count) {
    this._need(2 * count);
    const numbers = new Int16Array(count);
    for (let i = 0; i < count; i++, this._at += 2) {
      numbers[i] = this._view.getInt16(this._at, true);
    }
    return numbers;
  }

  /** @returns {Matrix} */
  matrix() {
    const [a, b, c, d, e, f] = this.f64s(6);
    return { a, b, c, d, e, f };
  }

  /** @param {number} count */
  f32s(count) {
    this._need(4 * count);
    return Array.from({ length: count }, () => this.f32());
  }

  /**
   * @param {number} most
   * @returns {number} A number that is not above `most`.
   */
  upTo(most) {
    const number = this.varint();
    if (number > most) throw new WireError(`expected at most ${most}, got ${number}`);
    return number;
  }

  /**
   * @param {number} count
   * @returns {number} `count`, if that many bits are left.
   */
  bitsLeftFor(count) {
    this._need(count / 8);
    return count;
  }

  /** @param {number} count */
  f64s(count) {
    this._need(8 * count);
    return Array.from({ length: count }, () => this.f64());
  }

  /** @param {readonly string[]} table */
  name(table) {
    const number = this.u8();
    if (number >= table.length) throw new WireError(`no name has number ${number}`);
    return table[number];
  }

  /** @param {number} length */
  _need(length) {
    if (this._at + length > this._bytes.length) throw new RangeError("too short");
  }
}

/**
 * @param {Reader} r
 * @returns {ViewState}
 */
function viewState(r) {
  const [session, applied, known] = [r.varint(), r.varint(), r.u8()];
  if (!known) return { session, applied, matrix: null, follow: 0 };
  return { session, applied, matrix: r.matrix(), follow: r.varint() };
}

/**
 * @param {Reader} r
 * @returns {[string, boolean]}
 */
function tag(r) {
  const number = r.u8();
  if (number < SVG_TAGS.length) return [SVG_TAGS[number], true];
  if (number < SVG_TAGS.length + HTML_TAGS.length) {
    return [HTML_TAGS[number - SVG_TAGS.length], false];
  }
  throw new WireError(`no tag has number ${number}`);
}

/**
 * @param {Reader} r
 * @returns {Map<string, number>}
 */
function listening(r) {
  const kinds = new Map();
  for (let left = r.u8(); left > 0; left--) kinds.set(r.name(EVENTS), r.u8());
  return kinds;
}

/**
 * The reader of each record. Arguments are read from left to right.
 *
 * @type {Record<number, (r: Reader, sink: Sink) => void>}
 */
const RECORDS = {
  [OP.DELTA]: (r, sink) => sink.delta(r.varint()),
  [OP.SNAPSHOT]: (r, sink) => sink.snapshot(r.varint()),
  [OP.MOUNT]: (r, sink) =>
    sink.mount(r.varint(), r.varint(), r.varint(), r.varint(), r.f64()),
  [OP.UNMOUNT]: (r, sink) => sink.unmount(r.varint()),
  [OP.MOUNT_CLASS]: (r, sink) => sink.mountClass(r.varint(), r.u8() > 0, r.string()),
  [OP.LISTEN]: (r, sink) => sink.listen(r.varint(), r.varint(), r.name(EVENTS), r.u8()),
  [OP.UNLISTEN]: (r, sink) => sink.unlisten(r.varint(), r.varint(), r.name(EVENTS)),
  [OP.VIEW_STATE]: (r, sink) => sink.viewState(r.varint(), viewState(r)),
  [OP.VIEW]: (r, sink) =>
    sink.view(r.varint(), r.varint(), r.name(VIEW_OPERATIONS), r.f64s(r.u8())),
  [OP.ATTACH]: (r, sink) =>
    sink.attach(r.varint(), r.varint(), r.string(), r.string(), r.json()),
  [OP.DETACH]: (r, sink) => sink.detach(r.varint()),
  [OP.MESSAGE]: (r, sink) => sink.message(r.varint(), r.json()),
  [OP.ERROR]: (r, sink) => sink.error(r.string()),
  [OP.PROBLEM]: (r, sink) => sink.problem(r.varint(), r.string()),
  [OP.CREATE]: (r, sink) => sink.create(r.varint(), r.varint(), r.varint(), ...tag(r)),
  [OP.TEXT]: (r, sink) => sink.text(r.varint(), r.varint(), r.varint(), r.string()),
  [OP.DOCUMENT]: (r, sink) => sink.document(r.varint()),
  [OP.BIND]: (r, sink) => sink.bind(r.varint(), r.string()),
  [OP.REMOVE]: (r, sink) => sink.remove(r.varint()),
  [OP.ATTRIBUTE]: (r, sink) => sink.attribute(r.varint(), r.name(ATTRIBUTES), r.string()),
  [OP.UNSET]: (r, sink) => sink.attribute(r.varint(), r.name(ATTRIBUTES), null),
  [OP.NAMED_ATTRIBUTE]: (r, sink) => sink.attribute(r.varint(), r.string(), r.string()),
  [OP.NAMED_UNSET]: (r, sink) => sink.attribute(r.varint(), r.string(), null),
  [OP.CLASSES]: (r, sink) => sink.classes(r.varint(), r.string()),
  [OP.STYLE]: (r, sink) => sink.style(r.varint(), r.string(), r.string()),
  [OP.POSE]: (r, sink) => sink.pose(r.varint(), r.f32(), r.f32(), r.f32()),
  [OP.FAR_POSE]: (r, sink) => sink.pose(r.varint(), r.f64(), r.f64(), r.f32()),
  [OP.MATRIX]: (r, sink) => sink.matrix(r.varint(), r.matrix()),
  [OP.DOTS]: (r, sink) => sink.dots(r.varint(), r.f32(), r.i16s(2 * r.varint())),
  [OP.RAYS]: (r, sink) => sink.dots(r.varint(), ...rays(r)),
  [OP.LINE]: (r, sink) => sink.line(r.varint(), r.varint(), r.f32s(2 * r.varint())),
  [OP.AGE]: (r, sink) => sink.age(r.varint(), r.varint() || null),
  [OP.AGE_LIMIT]: (r, sink) => sink.ageLimit(r.varint(), r.f32(), r.u8() > 0),
  [OP.DATA]: (r, sink) => sink.data(r.varint(), r.string()),
  [OP.EVENTS]: (r, sink) => sink.events(r.varint(), listening(r)),
  [OP.EMPTY]: (r, sink) => sink.empty(r.varint()),
  [OP.MAP]: (r, sink) => sink.map(r.varint(), r.varint(), r.f32(), r.f32()),
};

/**
 * Read a frame.
 *
 * @param {ArrayBuffer} buffer
 * @param {(header: Header) => Sink} begin Called with the header; returns the receiver.
 * @returns {Header}
 * @throws {WireError} If the bytes are not a frame of this version; records before the
 *     error have been processed by then.
 */
export function readFrame(buffer, begin) {
  const reader = new Reader(buffer);
  try {
    const version = reader.u16();
    if (version !== VERSION) {
      throw new VersionError(`got version ${version}, expected ${VERSION}`);
    }
    const reset = (reader.u8() & FLAG.RESET) > 0;
    const header = { reset, frame: reader.u32(), now: reader.f64() };
    readRecords(reader, begin(header));
    return header;
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    throw new WireError(`a frame ends in the middle of a record: ${error.message}`);
  }
}

/**
 * @param {Reader} reader
 * @param {Sink} sink
 */
function readRecords(reader, sink) {
  while (!reader.done) {
    const op = reader.u8();
    const read = RECORDS[op];
    if (!read) throw new WireError(`no record has number ${op}, at byte ${reader.at}`);
    read(reader, sink);
  }
}
