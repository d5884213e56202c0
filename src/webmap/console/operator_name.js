import { signOut } from "../web/access.js";
import { readStored, store } from "../web/stored.js";
import { byId, button, html, setText, svg } from "../web/tools/elements.js";

/** @typedef {{name: string, place: string}} Stated */
/**
 * @typedef {Stated & {address: string, number: number, verified: boolean, label: string,
 *     role: string, signsOut: boolean}} Operator
 */

/** Where the browser keeps what the person stated, for all pages. */
const KEPT = "webmap operator";

/** Most characters that a field takes; WebMap shortens a name further. */
const LONGEST = "200";

const SEEN = "Others see this name when you drive or press STOP.";

/** What a person who has signed in with a name may do, by role. */
const MAY = {
  viewer: "You may look, and press STOP. An operator can drive.",
  operator: "You may drive and send robots.",
  admin: "You may drive and send robots, and align their maps.",
};

/**
 * The name of the person at this page, in the bar. Until the person has answered, the
 * bar asks for it.
 *
 * The question covers nothing and takes no focus, so that keys and STOP work as always,
 * also while the form is open. Only a person who types in its fields cannot drive, as in
 * every field.
 *
 * @param {import('../web/map.js').MapCanvas} map
 * @param {object} options
 * @param {(message: Stated) => void} send
 */
export default function attach(map, options, send) {
  const name = new OperatorName(send);
  return {
    receive: (/** @type {Operator & {refused?: string}} */ message) => name.receive(message),
    destroy: () => name.element.remove(),
  };
}

class OperatorName {
  /** @param {(message: Stated) => void} send */
  constructor(send) {
    this._send = send;
    /** @type {Stated | null} */
    this._stated = kept();
    /** @type {Operator | null} What WebMap has sent last. */
    this._known = null;
    const icon = svg("svg", { class: "icon", "aria-hidden": "true" });
    icon.append(svg("use", { href: "#icon-person" }));
    const hint = html("span", "unseen", {}, "Your name on this page: ");
    this._shown = html("bdi", "");
    this._summary = html("summary", "", {}, icon, hint, this._shown);
    const typed = { maxlength: LONGEST, autocomplete: "off", dir: "auto" };
    this._name = html("input", "", typed);
    this._place = html("input", "", typed);
    this._save = button("", "Save", () => {});
    this._save.type = "submit";
    this._told = html("p", "word", { role: "status" }, SEEN);
    this._out = button("", "Sign out", () => void this._signOut());
    this._out.hidden = true;
    this._fields = [
      html("label", "", {}, "Your name on this page", this._name),
      html("label", "", {}, "Place, such as room 2", this._place),
      this._save,
    ];
    const form = html(
      "form",
      "bridge-list message-form",
      {},
      ...this._fields,
      this._told,
      this._out,
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this._send({ name: this._name.value, place: this._place.value });
    });
    this.element = html("details", "", { "data-webmap-menu": "" }, this._summary, form);
    byId("operator").append(this.element);
  }

  /** @param {Operator & {refused?: string}} message */
  receive(message) {
    if (message.refused !== undefined) {
      setText(this._told, message.refused || SEEN);
      if (!message.refused && this._known) this._accepted(this._known);
      return;
    }
    const first = this._known === null;
    this._known = message;
    if (first && this._stated?.name && !message.name) this._send(this._stated);
    // Another page of this browser may have stated it.
    else if (message.name) this._keep(message);
    this._show(message);
  }

  /** @param {Operator} operator Also one without a name: do not ask again. */
  _accepted(operator) {
    this._keep(operator);
    this._show(operator);
    this.element.open = false;
  }

  /** @param {Operator} operator */
  _show({ name, place, address, number, verified, label, role, signsOut }) {
    const asks = !name && this._stated === null;
    this.element.classList.toggle("asking", asks);
    const none = asks ? "Name?" : "No name";
    setText(this._shown, `${name || none}${number > 1 ? ` ${number}` : ""}`);
    this._summary.title = `You are ${label}${verified ? "" : ". This name is not verified"}`;
    this._name.value = name;
    this._place.value = place;
    this._place.placeholder = address;
    for (const each of this._fields) each.hidden = verified;
    if (verified) setText(this._told, MAY[/** @type {keyof typeof MAY} */ (role)] ?? "");
    this._out.hidden = !signsOut;
  }

  async _signOut() {
    const failed = await signOut();
    if (failed) setText(this._told, failed);
  }

  /** @param {Operator} operator */
  _keep({ name, place, verified }) {
    if (verified) return;
    this._stated = { name, place };
    store(KEPT, this._stated);
  }
}

/** @returns {Stated | null} What the person stated before; null if nothing. */
function kept() {
  const { name, place } = readStored(KEPT) ?? {};
  return typeof name === "string" && typeof place === "string" ? { name, place } : null;
}
