/** Messages of the display that are compressed. */

/**
 * @param {ArrayBuffer} data
 * @returns {boolean} Whether it is compressed with gzip; no frame starts so.
 */
export function isPacked(data) {
  const [first, second] = new Uint8Array(data, 0, Math.min(2, data.byteLength));
  return first === 0x1f && second === 0x8b;
}

/**
 * @param {ArrayBuffer} data
 * @returns {Promise<ArrayBuffer>} Decompressed; unchanged if that fails, so that the
 *     page reports a message that it cannot read.
 */
export async function unpacked(data) {
  if (!isPacked(data)) return data;
  try {
    const stream = new Blob([data]).stream().pipeThrough(new DecompressionStream("gzip"));
    return await new Response(stream).arrayBuffer();
  } catch {
    return data;
  }
}
