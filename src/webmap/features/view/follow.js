import { button, setAttribute } from "../../web/tools/elements.js";
import { endOf, lay } from "../../web/tools/overlay.js";

/** @typedef {import('../../web/map.js').MapCanvas} MapCanvas */
/** @typedef {import('../../web/browser_parts.js').BrowserPart} BrowserPart */

/**
 * A button that keeps the selected robot at its place on the screen, until the user
 * moves the view.
 *
 * Sends `{follow: id}` with the gate's id of the robot, or `{follow: null}`.
 *
 * @param {MapCanvas} map
 * @param {object} _options
 * @param {(message: object) => void} send
 * @returns {BrowserPart}
 */
export default function attach(map, _options, send) {
  const toggle = button("webmap-panel webmap-follow", "Follow", () => {
    send({ follow: map.following ? null : map.selected });
  });
  const show = () => {
    setAttribute(toggle, "aria-pressed", String(Boolean(map.following)));
    toggle.disabled = !map.following && map.selected === null;
  };
  toggle.title = "Move the map with the selected robot";
  /** @type {import('../../web/drive.js').Drive} */
  const drive = map.drive;
  // The view sends no event when following begins; its state is read instead.
  const destroy = endOf(
    lay(map, toggle, "bottom-right"),
    map.onSelect(show),
    drive.on("step", show),
  );
  show();
  return { destroy };
}
