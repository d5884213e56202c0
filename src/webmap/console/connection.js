import { byId, say } from "./dom.js";

/** @typedef {import('./console.js').Drive} Drive */

/**
 * Show whether commands would arrive, and which robots are "yours". How long they take
 * depends on the robot, too, so the driving panel has that figure.
 *
 * @param {Drive} drive
 */
export function showConnection(drive) {
  const link = byId("link");
  const show = () => {
    link.dataset.link = drive.state;
  };
  const mark = () => {
    for (const element of document.querySelectorAll("[data-robot]")) {
      if (!(element instanceof HTMLElement)) continue;
      const mine = drive.robots.get(element.dataset.robot ?? "")?.mine ?? false;
      if (mine !== "mine" in element.dataset) toggle(element, "mine", mine);
    }
  };
  const look = () => {
    show();
    mark();
    count();
  };
  look();
  const timer = setInterval(look, 500);
  const offs = [drive.on("state", show), drive.on("robot", mark)];
  return () => {
    clearInterval(timer);
    for (const off of offs) off();
  };
}

/** Say how many robots there are, and of how many the data is old. */
function count() {
  const rows = document.querySelectorAll("#robots > .row").length;
  const old = document.querySelectorAll("#robots > .row .age.stale").length;
  const robots = rows === 1 ? "1 robot" : `${rows} robots`;
  say(byId("robots-count"), old > 0 ? `${robots}, ${old} with old data` : robots);
}

/**
 * @param {HTMLElement} element
 * @param {string} name
 * @param {boolean} on
 */
function toggle(element, name, on) {
  if (on) element.dataset[name] = "";
  else delete element.dataset[name];
}
