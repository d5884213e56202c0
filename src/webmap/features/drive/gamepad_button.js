import { devicesOf } from "../../web/inputs/devices.js";
import { button, setHidden, svg } from "../../web/tools/elements.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('./gamepad_panel.js').GamepadPanel} GamepadPanel */

const NAME = "Gamepad settings";
const ICON =
  "M7.5 7h9c4 0 6 10 4 11s-4-4-5.5-4H9c-1.5 0-3.5 5-5.5 4s0-11 4-11z" +
  "M8 8.5v4M6 10.5h4M16.5 10.5h.1";

const NOT_LOADED = "The gamepad settings could not be loaded. Try again.";

/**
 * The button for the settings of gamepads, beside the buttons of driving while there is
 * a gamepad. The settings are loaded when somebody opens them.
 */
export class GamepadButton {
  /** @param {MapCanvas} map */
  constructor(map) {
    this._map = map;
    this._devices = devicesOf(map.drive);
    this._open = () => void this._openPanel();
    this.element = button("webmap-gamepad-go", "", this._open);
    this.element.title = NAME;
    this.element.setAttribute("aria-label", NAME);
    const drawing = { viewBox: "0 0 24 24", class: "webmap-symbol", "aria-hidden": "true" };
    this.element.append(svg("svg", drawing, svg("path", { d: ICON })));
    this.element.hidden = true;
    /** @type {GamepadPanel | null} */
    this._panel = null;
    this._gone = false;
    this._off = map.drive.on("step", () => this._offer());
  }

  destroy() {
    this._gone = true;
    this._off();
    this._panel?.destroy();
    this.element.remove();
    if (this._devices.padSettings === this._open) this._devices.padSettings = null;
  }

  _offer() {
    // One map of several on the page is enough.
    this._devices.padSettings ??= this._open;
    setHidden(this.element, !this._devices.pads?.seen);
  }

  async _openPanel() {
    // At once: the operator looks at the settings.
    this._map.drive.goNeutral();
    try {
      const { GamepadPanel } = await import("./gamepad_panel.js");
      if (this._gone) return;
      this._panel ??= new GamepadPanel(this._map);
      this._panel.open();
    } catch {
      this._map.drive.showGamepad({ kind: "hint", text: NOT_LOADED, settings: null });
    }
  }
}
