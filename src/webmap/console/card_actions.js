import { byId } from "./dom.js";
import { closeSheet } from "./sheet.js";
import { StopTestButton } from "./stop_test.js";

/** @typedef {import('./console.js').MapCanvas} MapCanvas */

/**
 * The buttons of the card that act at once. Only the test of its own stopping lets a
 * robot creep, and only one that this page holds.
 *
 * @param {MapCanvas} map
 * @param {(message: Record<string, unknown>) => void} send
 * @param {AbortSignal} signal
 */
export function listenToActions(map, send, signal) {
  const test = new StopTestButton(map.drive);
  const show = () => {
    test.show(map.selected, performance.now());
    const button = document.querySelector("[data-act=follow]");
    const pressed = `${map.following !== 0}`;
    if (button?.getAttribute("aria-pressed") === pressed) return;
    button?.setAttribute("aria-pressed", pressed);
  };
  const act = (/** @type {MouseEvent} */ event) => {
    if (!(event.target instanceof Element) || map.selected === null) return;
    const button = event.target.closest("[data-act]");
    if (!(button instanceof HTMLElement)) return;
    if (["follow", "send", "locate"].includes(button.dataset.act ?? "")) closeSheet();
    if (button.dataset.act === "cancel") map.drive.cancel(map.selected);
    if (button.dataset.act === "release") map.drive.release(map.selected);
    if (button.dataset.act === "stop-test") test.press(map.selected, performance.now());
    if (button.dataset.act !== "follow") return show();
    if (map.following) map.follow(0);
    else send({ op: "follow" });
    show();
  };
  byId("card").addEventListener("click", act, { signal });
  const timer = setInterval(show, 250);
  const offs = [
    map.onView(show),
    map.drive.on("robot", show),
    map.onSelect(() => {
      if (map.following) map.follow(0);
      show();
    }),
  ];
  return () => {
    clearInterval(timer);
    for (const off of offs) off();
  };
}
