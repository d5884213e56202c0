/** A reporter of node:test: a line of JSON for each test, as pytest's `--results` writes. */
import { relative } from "node:path";

export default async function* results(events) {
  for await (const { type, data } of events) {
    if (type !== "test:pass" && type !== "test:fail") continue;
    // Suites are counted by their tests, and so are files, which Node 18 reports too.
    if (data.details?.type === "suite" || data.name.endsWith(".test.js")) continue;
    const skipped = data.skip !== undefined && data.skip !== false;
    const outcome = type === "test:fail" ? "failed" : skipped ? "skipped" : "passed";
    const why = typeof data.skip === "string" ? data.skip : "";
    const test = `${relative(".", data.file ?? "")}::${data.name}`;
    const seconds = (data.details?.duration_ms ?? 0) / 1000;
    yield `${JSON.stringify({ test, outcome, why, seconds })}\n`;
  }
}
