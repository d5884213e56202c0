import { button, html, say } from "./elements.js";

/** @typedef {import('../drive.js').Drive} Drive */
/** @typedef {import('../motion/asking.js').Request} Request */

/** Who asks the operator for robots, each with the two answers there are. */
export class Requests {
  /** @param {Drive} drive */
  constructor(drive) {
    this._drive = drive;
    /** @type {Map<string, {item: HTMLElement, left: HTMLElement}>} */
    this._items = new Map();
    this.element = html("ul", "webmap-requests");
    this.element.hidden = true;
  }

  /** @param {Request[]} requests */
  show(requests) {
    const asked = requests.filter(({ mine }) => mine);
    const keys = new Set(asked.map(keyOf));
    for (const [key, { item }] of this._items) {
      if (keys.has(key)) continue;
      item.remove();
      this._items.delete(key);
    }
    for (const request of asked) {
      const { left } = this._items.get(keyOf(request)) ?? this._add(request);
      say(left, `(${request.left} s)`);
    }
    this.element.hidden = asked.length === 0;
  }

  /** @param {Request} request */
  _add(request) {
    const { robot, name, who } = request;
    const left = html("span", "webmap-request-left", { role: "timer" });
    const words = html(
      "p",
      "webmap-request-words",
      {},
      html("strong", "", { role: "alert" }, `${who} asks for ${name}`),
      " ",
      left,
    );
    const item = html(
      "li",
      "webmap-panel webmap-request",
      {},
      words,
      answer("Hand over", name, () => this._drive.grant(robot)),
      answer("Keep", name, () => this._drive.deny(robot)),
    );
    this.element.append(item);
    const made = { item, left };
    this._items.set(keyOf(request), made);
    return made;
  }
}

/**
 * @param {string} label
 * @param {string} name The robot's.
 * @param {() => void} act
 */
function answer(label, name, act) {
  const element = button("webmap-request-answer", label, act);
  element.setAttribute("aria-label", `${label} ${name}`);
  return element;
}

/** @param {Request} request */
function keyOf({ robot, by, who, name }) {
  return JSON.stringify([robot, by, who, name]);
}
