/**
 * Hides the goals that robots' own topics tell of, where the goal tool shows a goal: it is
 * the same one. What it has shown stays hidden afterwards, until the topic tells of
 * another.
 */
export class SentElsewhere {
  /** @param {SVGSVGElement} svg The map's. */
  constructor(svg) {
    this._svg = svg;
    /** @type {Set<string>} */
    this._robots = new Set();
    /** Poses that were shown, by robot.
     * @type {Map<string, string[]>} */
    this._seen = new Map();
    this._sheet = new CSSStyleSheet();
    document.adoptedStyleSheets.push(this._sheet);
  }

  destroy() {
    const sheets = document.adoptedStyleSheets;
    document.adoptedStyleSheets = sheets.filter((sheet) => sheet !== this._sheet);
  }

  /** @param {Set<string>} robots Those of which the goal tool shows a goal. */
  hideFor(robots) {
    const same = robots.size === this._robots.size;
    if (same && [...robots].every((robot) => this._robots.has(robot))) return;
    for (const robot of this._robots) {
      if (!robots.has(robot)) this._seen.set(robot, this._poses(robot));
    }
    this._robots = robots;
    this._sheet.replaceSync(hidden(robots, this._seen));
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
 * @param {Iterable<string>} robots Of which the goal tool shows a goal now.
 * @param {Iterable<[string, string[]]>} seen What it showed before, by robot.
 * @returns {string} The style sheet.
 */
export function hidden(robots, seen) {
  const rules = [...robots].map(selector);
  for (const [robot, poses] of seen) {
    for (const pose of poses) {
      rules.push(`${selector(robot)}[data-pose=${JSON.stringify(pose)}]`);
    }
  }
  return rules.map((rule) => `${rule} { display: none; }`).join("\n");
}
