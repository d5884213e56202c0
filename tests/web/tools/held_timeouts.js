import { afterEach, beforeEach, mock } from "node:test";

/** Let code that waits only for promises continue. */
export const settle = () => new Promise((resolve) => setImmediate(resolve));

/**
 * Hold back every timeout of a file's tests.
 *
 * @returns {(times?: number) => Promise<void>} Ends all waiting timeouts.
 */
export function holdTimeouts() {
  let held = [];
  beforeEach(() => {
    held = [];
    mock.method(globalThis, "setTimeout", (end) => held.push(end));
  });
  afterEach(() => mock.restoreAll());
  return async (times = 1) => {
    for (let n = 0; n < times; n++) {
      await settle();
      for (const end of held.splice(0)) end();
    }
    await settle();
  };
}
