import { byId, say, typing } from "./dom.js";

/**
 * Hide the robots whose name does not have what was typed in it. Enter selects the only
 * one that is left.
 *
 * @param {AbortSignal} signal
 */
export function listenToSearch(signal) {
  const input = /** @type {HTMLInputElement} */ (byId("search"));
  const filter = () => {
    const wanted = input.value.trim().toLowerCase();
    for (const row of document.querySelectorAll("#robots > .row")) {
      const name = row.querySelector(".name")?.textContent?.toLowerCase() ?? "";
      row.classList.toggle("filtered", !name.includes(wanted));
    }
    const none = wanted !== "" && hits().length === 0;
    say(byId("not-found"), none ? `No robot has “${input.value.trim()}” in its name.` : "");
  };
  input.addEventListener("input", filter, { signal });
  const newcomers = new MutationObserver(filter);
  newcomers.observe(byId("robots"), { childList: true });
  signal.addEventListener("abort", () => newcomers.disconnect());
  const choose = (/** @type {KeyboardEvent} */ event) => {
    const [only, ...more] = event.key === "Enter" ? hits() : [];
    if (only && more.length === 0) only.click();
  };
  input.addEventListener("keydown", choose, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "/" || event.ctrlKey || event.metaKey || typing(event)) return;
    event.preventDefault();
    input.focus();
  };
  document.addEventListener("keydown", key, { signal });
}

/** @returns {HTMLElement[]} What selects the robots that are listed. */
function hits() {
  return [...document.querySelectorAll("#robots > .row:not(.filtered) [aria-pressed]")].filter(
    (button) => button instanceof HTMLElement,
  );
}
