import { devicesOf } from "./inputs/devices.js";
import { standingStops } from "./motion/stops.js";
import { html, setText, stopButton } from "./tools/elements.js";

/**
 * Show STOP ALL on a page without a picture, which has no other STOP; the keys act too.
 *
 * @param {import('./drive.js').Drive} drive
 * @returns {() => void} Removes it.
 */
export function showBareStop(drive) {
  const all = stopButton("", "STOP ALL", () => void drive.stop("*"));
  const result = html("p", "", { role: "status" });
  const label = { "aria-label": "STOP for all robots" };
  const box = html("section", "webmap-notice alert webmap-bare-stop", label, all, result);
  const show = () => {
    const waiting = drive.verdicts.map(({ name, text }) => `${name}: ${text}.`);
    setText(result, standingStops(drive.robots.values()) || waiting.join(" "));
  };
  const offs = [devicesOf(drive).open(), drive.on("step", show)];
  document.body.append(box);
  return () => {
    for (const off of offs) off();
    box.remove();
  };
}
