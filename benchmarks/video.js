// Encodes a moving scene as H.264 and as JPEG of the same quality, in the page.
async ([count, bitrate]) => {
  const [WIDTH, HEIGHT] = [640, 480];
  const scene = new OffscreenCanvas(WIDTH, HEIGHT);
  const pen = scene.getContext("2d", { willReadFrequently: true });
  // A wall with patches and a little noise, as a camera sees it, that passes by.
  const wall = new OffscreenCanvas(2 * WIDTH, HEIGHT);
  const brush = wall.getContext("2d");
  brush.fillStyle = "#888";
  brush.fillRect(0, 0, 2 * WIDTH, HEIGHT);
  let seed = 1;
  const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
  for (let n = 0; n < 1500; n++) {
    // Grey, because browsers convert the colours of videos and of JPEG differently.
    brush.fillStyle = `hsl(0 0% ${20 + 60 * random()}%)`;
    const size = 8 + 90 * random() ** 3;
    brush.fillRect(2 * WIDTH * random(), HEIGHT * random(), size, size);
  }
  const draw = (number) => {
    pen.drawImage(wall, -3 * number, 0);
    const pixels = pen.getImageData(0, 0, WIDTH, HEIGHT);
    for (let at = 0; at < pixels.data.length; at++) {
      if (at % 4 !== 3) pixels.data[at] += 6 * (random() - 0.5);
    }
    pen.putImageData(pixels, 0, 0);
    return pixels.data;
  };
  const copy = new OffscreenCanvas(WIDTH, HEIGHT);
  const reader = copy.getContext("2d", { willReadFrequently: true });
  const psnr = (shown, truth) => {
    reader.drawImage(shown, 0, 0);
    const { data } = reader.getImageData(0, 0, WIDTH, HEIGHT);
    let sum = 0;
    for (let at = 0; at < data.length; at++) sum += (data[at] - truth[at]) ** 2;
    return 10 * Math.log10((255 * 255 * data.length * 0.75) / sum);
  };
  const jpegOf = async (quality) => scene.convertToBlob({ type: "image/jpeg", quality });
  const text = async (blob) => {
    const bytes = new Uint8Array(await blob.arrayBuffer());
    let found = "";
    for (const byte of bytes) found += String.fromCharCode(byte);
    return btoa(found);
  };
  const mean = (values) => values.reduce((a, b) => a + b) / values.length;

  const packets = [];
  const encoder = new VideoEncoder({
    output: (chunk) => {
      const data = new Uint8Array(chunk.byteLength);
      chunk.copyTo(data);
      packets.push({ key: chunk.type === "key", data });
    },
    error: (error) => { throw error; },
  });
  encoder.configure({
    codec: "avc1.42001f", width: WIDTH, height: HEIGHT, bitrate, framerate: 15,
    latencyMode: "realtime", avc: { format: "annexb" },
  });
  const truths = [];
  for (let number = 0; number < count; number++) {
    truths.push(draw(number));
    const frame = new VideoFrame(scene, { timestamp: number * 66667 });
    encoder.encode(frame, { keyFrame: number % 30 === 0 });
    frame.close();
    await encoder.flush();
  }
  const qualities = [];
  const decoder = new VideoDecoder({
    output: (frame) => {
      qualities.push(psnr(frame, truths[qualities.length]));
      frame.close();
    },
    error: (error) => { throw error; },
  });
  decoder.configure({ codec: "avc1.42001f", optimizeForLatency: true });
  packets.forEach(({ key, data }, timestamp) => {
    decoder.decode(new EncodedVideoChunk({ type: key ? "key" : "delta", timestamp, data }));
  });
  await decoder.flush();
  const wanted = mean(qualities);
  // The lowest quality of JPEG that is as good.
  let [low, high] = [0.02, 1];
  for (let step = 0; step < 8; step++) {
    const middle = (low + high) / 2;
    pen.putImageData(new ImageData(truths[count >> 1], WIDTH, HEIGHT), 0, 0);
    const picture = await createImageBitmap(await jpegOf(middle));
    if (psnr(picture, truths[count >> 1]) < wanted) low = middle;
    else high = middle;
  }
  const jpegs = [];
  const reached = [];
  for (const truth of truths) {
    pen.putImageData(new ImageData(truth, WIDTH, HEIGHT), 0, 0);
    const blob = await jpegOf(high);
    reached.push(psnr(await createImageBitmap(blob), truth));
    jpegs.push(await text(blob));
  }
  const h264 = [];
  for (const { data } of packets) h264.push(await text(new Blob([data])));
  return { "H.264": [h264, wanted], JPEG: [jpegs, mean(reached)] };
}
