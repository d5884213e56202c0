import { html, say, stopButton } from "./elements.js";

/** The STOP buttons of the page that can be pressed, but for those of an alarm. */
const ORIGINALS = ".webmap-stop-button:enabled:not(.webmap-alarm *)";

/** Pixels between a twin and what lies beside it. */
const GAP = 16;

/**
 * Copies of the page's STOP buttons, each at the place of its original.
 *
 * Something that covers the page contains them, so that STOP is where it always is.
 */
export class StopTwins {
  constructor() {
    this.element = html("div", "webmap-stop-twins");
    /** @type {Map<HTMLButtonElement, HTMLButtonElement>} */
    this._twins = new Map();
  }

  /**
   * Follow the originals: which there are, where they are and what they say.
   *
   * @returns {{all: boolean, top: number, bottom: number}} `all`: whether one of them
   *     stops all robots. `top` and `bottom`: pixels that the twins need there.
   */
  place() {
    const originals = [...document.querySelectorAll(ORIGINALS)].filter(isInSight);
    for (const [original, twin] of this._twins) {
      if (originals.includes(original)) continue;
      this._twins.delete(original);
      twin.remove();
    }
    const room = { all: false, top: 0, bottom: 0 };
    for (const original of originals) {
      const { left, top, right, bottom } = original.getBoundingClientRect();
      this._twinOf(original).style.inset = [
        `${top}px`,
        `${innerWidth - right}px`,
        `${innerHeight - bottom}px`,
        `${left}px`,
      ].join(" ");
      room.all ||= original.matches(".webmap-stop-all");
      if (top + bottom < innerHeight) room.top = Math.max(room.top, bottom + GAP);
      else room.bottom = Math.max(room.bottom, innerHeight - top + GAP);
    }
    return room;
  }

  /** @param {HTMLButtonElement} original */
  _twinOf(original) {
    const known = this._twins.get(original);
    const twin = known ?? stopButton("webmap-stop-twin", "", () => original.click());
    say(twin, original.textContent ?? "");
    twin.dataset.robot = original.dataset.robot ?? "";
    const label = original.getAttribute("aria-label") ?? "";
    if (twin.ariaLabel !== label && label) twin.ariaLabel = label;
    if (!known) {
      this._twins.set(original, twin);
      this.element.append(twin);
    }
    return twin;
  }
}

/**
 * @param {Element} element
 * @returns {element is HTMLButtonElement} Whether its middle is on the screen.
 */
function isInSight(element) {
  if (!(element instanceof HTMLButtonElement)) return false;
  const { left, top, width, height } = element.getBoundingClientRect();
  const [x, y] = [left + width / 2, top + height / 2];
  return width > 0 && x > 0 && x < innerWidth && y > 0 && y < innerHeight;
}
