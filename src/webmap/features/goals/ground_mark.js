import { onScreen } from "../../web/tools/aim.js";
import { html, setHidden, setText, svg } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/view.js').Point} Point */
/** @typedef {{x: number, y: number, word: string | null}} Ground */

/** Milliseconds after which a question without an answer is asked again. */
const PATIENCE = 1000;
/** Milliseconds for which the word of an earlier place is shown at a mark that moves. */
const BRIEF = 300;

/**
 * A ring and a word at the aimed goal: what the maps have there (free, unknown, wall).
 *
 * The display has the cells. It is asked for one place at a time, and for the newest place
 * when it has answered.
 */
export class GroundMark {
  /**
   * @param {MapCanvas} map
   * @param {(place: Point) => void} ask
   */
  constructor(map, ask, now = () => performance.now()) {
    this._map = map;
    this._ask = ask;
    this._now = now;
    /** @type {Point | null} */
    this._place = null;
    /** @type {Point | null} The place that the display was asked for last. */
    this._asked = null;
    this._askedAt = -Infinity;
    /** @type {{ground: Ground | null, at: number}} The newest answer. */
    this._heard = { ground: null, at: -Infinity };
    this._name = "";
    this._ring = svg("circle", { r: "17", class: "webmap-ground-ring" });
    this._word = html("span", "webmap-surface webmap-ground-word", { "aria-live": "polite" });
    const drawing = { class: "webmap-aim-drawing", "aria-hidden": "true" };
    this.destroy = endOf(
      lay(map, svg("svg", drawing, this._ring)),
      lay(map, html("div", "webmap-goal-labels", {}, this._word)),
      map.onView(() => this._draw()),
    );
    this.show(null);
  }

  /**
   * @param {Point | null} place In metres; null where nothing is aimed.
   * @param {string} [name] Whose goal it is, if several robots are selected.
   */
  show(place, name = "") {
    this._place = place;
    this._name = name;
    if (place === null) [this._asked, this._askedAt] = [null, -Infinity];
    else this._look(place);
    this._draw();
  }

  /** @param {Ground} ground The answer of the display. */
  hear(ground) {
    // The answer to an earlier question is ignored: the answer to the last will come.
    if (!isAt(ground, this._asked)) return;
    this._askedAt = -Infinity;
    this._heard = { ground, at: this._now() };
    if (this._place !== null) this._look(this._place);
    this._draw();
  }

  /** @param {Point} place */
  _look(place) {
    if (isAt(place, this._asked) || this._now() - this._askedAt < PATIENCE) return;
    this._asked = { x: place.x, y: place.y };
    this._askedAt = this._now();
    this._ask(this._asked);
  }

  /** What is shown; empty where no map is, and while no answer is new enough. */
  get word() {
    const { ground, at } = this._heard;
    if (this._place === null || ground === null) return "";
    const current = isAt(ground, this._place) || this._now() - at < BRIEF;
    return current ? (ground.word ?? "") : "";
  }

  _draw() {
    const { word } = this;
    setHidden(this._word, word === "");
    this._ring.style.display = word === "" ? "none" : "";
    if (word === "" || this._place === null) return;
    const { x, y } = onScreen(this._map.view, { ...this._place, yaw: 0 });
    this._ring.dataset.ground = this._word.dataset.ground = word;
    this._ring.setAttribute("transform", `translate(${x} ${y})`);
    this._word.style.transform = `translate(${x}px, ${y + 24}px) translate(-50%, 0)`;
    setText(this._word, this._name ? `${this._name}: ${word}` : word);
  }
}

/**
 * @param {Point} one
 * @param {Point | null} other
 */
function isAt(one, other) {
  return one.x === other?.x && one.y === other.y;
}
