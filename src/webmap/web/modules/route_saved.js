import { button, html, say } from "./elements.js";

/** @typedef {import('./aim.js').Pose} Pose */

/** The routes that the server keeps: their names, and what can be done with them. */
export class SavedRoutes {
  /**
   * @param {boolean} saves Whether this viewer may change them.
   * @param {(message: object) => void} send
   * @param {() => {points: Pose[], loop: boolean}} route What would be saved.
   */
  constructor(saves, send, route) {
    this._send = send;
    this._route = route;
    this._chosen = html("select", "webmap-route-chosen", { "aria-label": "Saved routes" });
    this._load = button("webmap-route-load", "Load", () => this._ask("load"));
    this._delete = button("webmap-route-delete", "Delete", () => this._ask("delete"));
    this._name = html("input", "webmap-route-name", {
      type: "text",
      maxlength: "60",
      placeholder: "Name",
      "aria-label": "Name of the route",
    });
    this._save = button("webmap-route-save", "Save", () => this._keep());
    this._word = html("p", "webmap-route-word", { role: "status" });
    this._there = html(
      "div",
      "webmap-route-row",
      {},
      this._chosen,
      this._load,
      ...(saves ? [this._delete] : []),
    );
    const keep = html("div", "webmap-route-row", {}, this._name, this._save);
    this.element = html(
      "div",
      "webmap-route-saved",
      {},
      this._there,
      ...(saves ? [keep] : []),
      this._word,
    );
    this._there.hidden = true;
  }

  /** @param {any} message */
  receive(message) {
    const { routes, loaded, saved, problem } = message ?? {};
    if (Array.isArray(routes)) {
      const { value } = this._chosen;
      this._chosen.replaceChildren(
        ...routes.map((name) => html("option", "", { value: name }, name)),
      );
      if (routes.includes(saved ?? value)) this._chosen.value = saved ?? value;
      this._there.hidden = routes.length === 0;
      say(this._word, saved ? `Saved as ${saved}.` : "");
    }
    if (loaded) {
      this._name.value = loaded.name;
      say(this._word, `Loaded ${loaded.name}.`);
    }
    if (typeof problem === "string") say(this._word, problem);
  }

  /** @param {'load' | 'delete'} op */
  _ask(op) {
    if (this._chosen.value !== "") this._send({ op, name: this._chosen.value });
  }

  _keep() {
    const { points, loop } = this._route();
    if (points.length === 0) say(this._word, "There are no points to save.");
    else if (this._name.value.trim() === "") say(this._word, "Give the route a name.");
    else this._send({ op: "save", name: this._name.value.trim(), route: { points, loop } });
  }
}
