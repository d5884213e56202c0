import { byId, typing } from "./dom.js";

/**
 * Hide the robots whose name does not have what was typed in it.
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
  };
  input.addEventListener("input", filter, { signal });
  const key = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "/" || event.ctrlKey || event.metaKey || typing(event)) return;
    event.preventDefault();
    input.focus();
  };
  document.addEventListener("keydown", key, { signal });
}
