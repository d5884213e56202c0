import assert from "node:assert/strict";
import { beforeEach, describe, test } from "node:test";

globalThis.document ??= { baseURI: "http://127.0.0.1/", querySelector: () => null };
const { readPacket, VideoDecoding } = await import(
  "../../../src/webmap/features/cameras/video_picture.js"
);

function message(key, stamp, codec, data) {
  const head = new Uint8Array(key ? 18 + codec.length : 9);
  const view = new DataView(head.buffer);
  view.setUint8(0, key ? 1 : 0);
  view.setFloat64(1, stamp, true);
  if (key) {
    view.setUint32(9, 640, true);
    view.setUint32(13, 480, true);
    view.setUint8(17, codec.length);
    head.set(new TextEncoder().encode(codec), 18);
  }
  return new Uint8Array([...head, ...data]).buffer;
}

describe("a message of a video", () => {
  test("with a key picture has what a decoder needs", () => {
    const packet = readPacket(message(true, 12.5, "avc1.42c01f", [1, 2, 3]));
    assert.deepEqual(
      { ...packet, data: [...packet.data] },
      { key: true, stamp: 12.5, codec: "avc1.42c01f", width: 640, height: 480, data: [1, 2, 3] },
    );
  });

  test("with another picture has only the time and the packet", () => {
    const packet = readPacket(message(false, 0.5, "", [7]));
    assert.deepEqual([packet.key, packet.stamp, [...packet.data]], [false, 0.5, [7]]);
  });
});

class FakeDecoder extends EventTarget {
  constructor(init) {
    super();
    Object.assign(this, init);
    Object.assign(this, { state: "unconfigured", decodeQueueSize: 0, chunks: [], configs: [] });
  }

  configure(config) {
    this.configs.push(config);
    this.state = "configured";
  }

  decode(chunk) {
    if (chunk.data[0] === 9) throw new TypeError("not valid");
    this.chunks.push(chunk);
  }

  close() {
    this.state = "closed";
  }

  fails(error) {
    this.state = "closed";
    this.error(error);
  }

  returns({ timestamp }) {
    const frame = { timestamp, open: true, close: () => (frame.open = false) };
    this.output(frame);
    return frame;
  }
}

describe("the decoding of a video", () => {
  let decoders, shown, words, decoding;
  const key = (number = 0, codec = "avc1.42c01f") => ({
    ...{ key: true, codec, width: 640, height: 480, data: [number] },
  });
  const delta = (number = 0) => ({ ...key(number), key: false, codec: "" });
  beforeEach(() => {
    [decoders, shown, words] = [[], [], []];
    globalThis.EncodedVideoChunk = class {
      constructor(init) {
        Object.assign(this, init);
      }
    };
    const make = (init) => {
      decoders.push(new FakeDecoder(init));
      return decoders.at(-1);
    };
    decoding = new VideoDecoding(
      (frame, taken) => shown.push([frame.open, taken]),
      (text) => words.push(text),
      make,
    );
  });

  test("begins with a key picture", () => {
    decoding.decode(delta(), 1);
    assert.equal(decoders.length, 0);
    decoding.decode(key(), 2);
    decoding.decode(delta(), 3);
    assert.equal(decoders.length, 1);
    assert.deepEqual(decoders[0].chunks.map(({ type }) => type), ["key", "delta"]);
    const [config] = decoders[0].configs;
    assert.equal(config.optimizeForLatency, true);
    assert.ok(!("description" in config), "without a description it is Annex B");
  });

  test("shows each picture with its own time, in any order, and closes it", () => {
    decoding.decode(key(), 100);
    decoding.decode(delta(), 200);
    decoding.decode(delta(), 300);
    const [first, late, early] = decoders[0].chunks;
    const frames = [first, early, late].map((chunk) => decoders[0].returns(chunk));
    assert.deepEqual(shown, [[true, 100], [true, 300], [true, 200]]);
    assert.ok(frames.every(({ open }) => !open));
  });

  test("goes on with the same decoder at the next key picture of the same kind", () => {
    for (const packet of [key(), delta(), key(), delta()]) decoding.decode(packet, 0);
    assert.equal(decoders.length, 1);
  });

  test("begins again for another size or codec", () => {
    decoding.decode(key(), 1);
    decoding.decode({ ...key(), width: 320 }, 2);
    decoding.decode(key(0, "vp09.00.51.08"), 3);
    assert.equal(decoders.length, 3);
    assert.deepEqual(decoders.map(({ state }) => state), ["closed", "closed", "configured"]);
    const frame = decoders[0].returns({ timestamp: 1 });
    assert.deepEqual([shown, frame.open], [[], false]);
  });

  test("shows nothing after an error until the next key picture", () => {
    decoding.decode(key(), 1);
    decoders[0].fails(new DOMException("", "EncodingError"));
    assert.match(words.at(-1), /could not decode the video: waiting for the next key/);
    decoding.decode(delta(), 2);
    assert.equal(decoders.length, 1);
    decoding.decode(key(), 3);
    decoders[1].returns(decoders[1].chunks[0]);
    assert.deepEqual(shown, [[true, 3]]);
    assert.equal(words.at(-1), "");
  });

  test("survives a packet that the decoder refuses", () => {
    decoding.decode(key(), 1);
    decoding.decode(delta(9), 2);
    decoding.decode(delta(), 3);
    decoding.decode(key(), 4);
    assert.equal(decoders.length, 2);
  });

  test("names a codec that the browser does not have", () => {
    decoding.decode(key(0, "vp09.00.51.08"), 1);
    decoders[0].fails(new DOMException("", "NotSupportedError"));
    assert.match(words.at(-1), /cannot decode this video \(vp09\.00\.51\.08\): use H\.264/);
  });

  test("skips to a key picture when many others wait in the decoder", () => {
    decoding.decode(key(), 1);
    decoders[0].decodeQueueSize = 4;
    decoding.decode(key(), 2);
    assert.equal(decoders.length, 1);
    decoders[0].decodeQueueSize = 5;
    decoding.decode(delta(), 3);
    decoding.decode(key(), 4);
    assert.deepEqual([decoders.length, decoders[0].state], [2, "closed"]);
    assert.equal(decoders[1].chunks.length, 1);
  });

  test("ends when too many pictures wait in the decoder", () => {
    decoding.decode(key(), 1);
    decoders[0].decodeQueueSize = 601;
    decoding.decode(delta(), 2);
    assert.equal(decoders[0].state, "closed");
    assert.match(words.at(-1), /too slow for this video/);
    decoding.decode(key(), 3);
    assert.equal(decoders.length, 2);
  });

  test("keeps few times of pictures that never come", () => {
    decoding.decode(key(), 0);
    for (let number = 0; number < 3000; number++) decoding.decode(delta(), number);
    assert.ok(decoding._taken.size <= 1200);
  });
});
