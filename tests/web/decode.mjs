// Reads lines of frames in base64 and answers each with what a page would show.
import { createInterface } from "node:readline";

import { Tree, bufferOf } from "./tree.mjs";

for await (const line of createInterface({ input: process.stdin })) {
  const tree = new Tree();
  let answer;
  try {
    for (const frame of JSON.parse(line)) tree.apply(bufferOf(Buffer.from(frame, "base64")));
    answer = { picture: tree.picture(), said: tree.said };
  } catch (error) {
    answer = { error: String(error), kind: error.constructor.name };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}
