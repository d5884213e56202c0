import { onScreen } from "../../web/tools/aim.js";
import { button, html, setHidden, setText, svg } from "../../web/tools/elements.js";
import { look } from "../../web/tools/goals.js";
import { endOf, lay } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/view.js').Point} Point */
/** @typedef {import('../../web/tools/aim.js').Pose} Pose */
/** @typedef {import('../../web/motion/report.js').GoalReport} GoalReport */
/** @typedef {{x: number, y: number, word: string | null}} Ground */

/** Milliseconds after which a question without an answer is asked again. */
const PATIENCE = 1000;
/** Milliseconds for which the word of an earlier place is shown at a mark that moves. */
const BRIEF = 300;

/** Points along x, 44 pixels long, with a ring around the goal's position. */
const ARROW = "M7 0H34M0 7a7 7 0 1 1 .01 0M44 0 30-8v16z";

/** The sign in the ring in addition to the colour, by the shape of the goal's state. */
/** @type {Readonly<Record<string, string>>} */
const SIGNS = {
  sent: "",
  way: "M-3 0h6M0-3v6",
  unknown: "M-2-2a2 2 0 1 1 2 3v1M0 4v.1",
  reached: "M-3 0-1 3 4-3",
  failed: "M-3-3 3 3M-3 3 3-3",
  cancelled: "M-3 0h6",
};

/**
 * @typedef {object} Mark
 * @property {SVGGElement} group
 * @property {SVGPathElement} arrow
 * @property {SVGPathElement} sign
 * @property {HTMLElement} label
 * @property {HTMLElement} text
 * @property {HTMLButtonElement} end
 * @property {Pose} pose
 */

/** Goals over a map: an arrow at each robot's goal, and the state as text. */
export class GoalMarks {
  /**
   * @param {MapCanvas} map
   * @param {(robot: string) => void} onEnd Called when the button at a goal was
   *     pressed.
   */
  constructor(map, onEnd) {
    this._map = map;
    this._onEnd = onEnd;
    /** @type {Map<string, Mark>} */
    this._marks = new Map();
    this._drawing = svg("svg", { class: "webmap-aim-drawing", "aria-hidden": "true" });
    this._labels = html("div", "webmap-goal-labels");
    this._elsewhere = new TopicGoals(map.svg);
    this.destroy = endOf(
      this._elsewhere,
      lay(map, this._drawing),
      lay(map, this._labels),
      map.onView(() => this._place()),
    );
  }

  /** @param {boolean} aiming Whether a press is for the map below the buttons. */
  letThrough(aiming) {
    this._labels.classList.toggle("aiming", aiming);
  }

  /**
   * @param {Map<string, {pose: Pose, state?: string, goal?: GoalReport, name?: string,
   *     mine?: boolean, cancels?: boolean}>} goals By robot. `state`: aimed, asked or
   *     sent, for goals that the gate does not report yet. `mine`: the robot is
   *     selected.
   */
  show(goals) {
    for (const [robot, mark] of this._marks) {
      if (goals.has(robot)) continue;
      mark.group.remove();
      mark.label.remove();
      this._marks.delete(robot);
    }
    for (const [robot, shown] of goals) this._update(robot, shown);
    this._elsewhere.hideFor(new Set(goals.keys()));
    this._place();
  }

  /**
   * @param {string} robot
   * @param {{pose: Pose, state?: string, goal?: GoalReport, name?: string, mine?: boolean,
   *     cancels?: boolean}} shown
   */
  _update(robot, { pose, state = "", goal, name = "", mine = false, cancels = false }) {
    const mark = this._marks.get(robot) ?? this._make(robot);
    mark.pose = pose;
    const seen = goal ? look(goal) : null;
    const kind = seen ? seen.shape : state;
    mark.group.setAttribute("class", mine ? "webmap-goal-mark mine" : "webmap-goal-mark");
    mark.arrow.setAttribute("class", `webmap-goal-arrow ${kind}`);
    mark.sign.setAttribute("d", seen ? SIGNS[seen.shape] : "");
    setHidden(mark.label, seen === null);
    if (seen === null) return;
    mark.label.className = `webmap-surface webmap-goal-label ${kind}${mine ? " mine" : ""}`;
    setText(mark.text, mine ? seen.text : `${name}: ${seen.text.split(",")[0]}`);
    setHidden(mark.end, !mine || (!seen.over && !cancels) || goal?.state === "cancelling");
    const does = seen.over ? "Hide this goal" : "Cancel goal";
    mark.end.setAttribute("aria-label", does);
    mark.end.title = does;
  }

  /** @param {string} robot */
  _make(robot) {
    const arrow = svg("path", { d: ARROW });
    const sign = svg("path", { class: "webmap-symbol webmap-goal-sign" });
    const group = svg("g", { "data-goal-of": robot }, arrow, sign);
    const text = html("span", "webmap-goal-words");
    const end = button("webmap-goal-end", "×", () => this._onEnd(robot));
    const label = html("div", "webmap-surface webmap-goal-label", { "data-goal-of": robot }, text, end);
    this._drawing.append(group);
    this._labels.append(label);
    const mark = { group, arrow, sign, label, text, end, pose: { x: 0, y: 0, yaw: 0 } };
    this._marks.set(robot, mark);
    return mark;
  }

  _place() {
    const { view, width, height } = this._map;
    for (const { arrow, sign, label, pose } of this._marks.values()) {
      const { x, y, degrees } = onScreen(view, pose);
      arrow.setAttribute("transform", `translate(${x} ${y}) rotate(${degrees})`);
      sign.setAttribute("transform", `translate(${x} ${y})`);
      const inside = x >= 0 && y >= 0 && x <= width && y <= height;
      label.classList.toggle("outside", !inside);
      // Beside the arrow, not on it: to the right for the selected robot, so that the
      // texts of a group do not cover each other, and inside the map.
      const tip = x + 44 * Math.cos((degrees * Math.PI) / 180);
      const room = label.classList.contains("mine") && x < 0.55 * width;
      const at = room ? Math.max(x, tip) + 12 : Math.min(x, tip) - 12;
      label.style.transform = `translate(${at}px, ${y}px) translate(${room ? 0 : -100}%, -50%)`;
    }
  }
}

/**
 * Hides the goals of robots' own topics where the goal tool shows a goal, because both
 * are the same goal. A hidden goal stays hidden afterwards, until the topic sends
 * another.
 */
class TopicGoals {
  /** @param {SVGSVGElement} mapSvg The map's element. */
  constructor(mapSvg) {
    this._svg = mapSvg;
    /** @type {Set<string>} */
    this._robots = new Set();
    /**
     * Poses that were shown, by robot.
     * @type {Map<string, string[]>}
     */
    this._seen = new Map();
    this._sheet = new CSSStyleSheet();
    document.adoptedStyleSheets.push(this._sheet);
  }

  destroy() {
    const sheets = document.adoptedStyleSheets;
    document.adoptedStyleSheets = sheets.filter((sheet) => sheet !== this._sheet);
  }

  /** @param {Set<string>} robots The robots whose goal the goal tool shows. */
  hideFor(robots) {
    const same = robots.size === this._robots.size;
    if (same && [...robots].every((robot) => this._robots.has(robot))) return;
    for (const robot of this._robots) {
      if (!robots.has(robot)) this._seen.set(robot, this._poses(robot));
    }
    this._robots = robots;
    this._sheet.replaceSync(hidingRules(robots, this._seen));
  }

  /** @param {string} robot @returns {string[]} */
  _poses(robot) {
    const drawn = this._svg.querySelectorAll(selector(robot));
    return [...drawn].map((goal) => goal.getAttribute("data-pose") ?? "").filter(Boolean);
  }
}

/** @param {string} robot @returns {string} */
const selector = (robot) => `[data-robot=${JSON.stringify(robot)}] .posestamped.goal`;

/**
 * @param {Iterable<string>} robots The robots whose goal the goal tool shows now.
 * @param {Iterable<[string, string[]]>} seen The goals that the tool showed before, by
 *     robot.
 * @returns {string} The style sheet.
 */
export function hidingRules(robots, seen) {
  const rules = [...robots].map(selector);
  for (const [robot, poses] of seen) {
    for (const pose of poses) {
      rules.push(`${selector(robot)}[data-pose=${JSON.stringify(pose)}]`);
    }
  }
  return rules.map((rule) => `${rule} { display: none; }`).join("\n");
}

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
