import { RefusalNote } from "../motion/report.js";
import { setText } from "./elements.js";

/**
 * Show in an element why an operation was refused, until the causes of all robots are over.
 *
 * @param {Element} element
 * @param {string} text
 * @param {import('../drive.js').Drive} drive
 * @param {readonly string[]} robots
 */
export function showNote(element, text, drive, robots) {
  const notes = robots.map((robot) => ({ robot, note: new RefusalNote(text, "", performance.now()) }));
  setText(element, text);
  const off = drive.on("step", () => {
    const now = performance.now();
    const over = notes.filter(({ robot, note }) => note.isOver(drive.robots.get(robot), now));
    const replaced = element.textContent !== text;
    if (!replaced && over.length < notes.length) return;
    if (!replaced) setText(element, "");
    off();
  });
}
