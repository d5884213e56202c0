import { listenToActions } from "./card_actions.js";
import { showConnection } from "./connection.js";
import { listenToHelp } from "./help.js";
import { listenToList } from "./into_view.js";
import { spreadNames } from "./names.js";
import { listenToSearch } from "./search.js";
import { listenToSheet, nameSheet } from "./sheet.js";
import { keepSizes, listenToTools } from "./view_tools.js";

/**
 * What of the console acts in the browser itself, because it must be quick, or work
 * while the display cannot be reached: the state of the connection, who "you" are, the
 * buttons of the view and of the card, the search, the sheet on a phone, help.
 *
 * @typedef {{a: number, b: number, c: number, d: number, e: number, f: number}} Matrix
 *
 * @typedef {object} Report
 * @property {string} robot
 * @property {boolean} mine
 * @property {{state: string, text: string} | null} [test] The newest stop test.
 *
 * @typedef {object} Drive
 * @property {string} state
 * @property {ReadonlyMap<string, Report>} robots
 * @property {(kind: string, fn: () => void) => () => void} on
 * @property {(robot: string) => void} cancel
 * @property {(robot: string) => void} release
 * @property {(robot: string) => void} stopTest
 * @property {() => void} doubt
 *
 * @typedef {object} MapCanvas
 * @property {SVGSVGElement} svg
 * @property {SVGGElement} world
 * @property {Matrix} view
 * @property {number} width
 * @property {number} height
 * @property {string | null} selected
 * @property {number} following
 * @property {(id: number) => void} follow
 * @property {Drive} drive
 * @property {(view: Matrix, options?: {user?: boolean}) => void} setView
 * @property {(fn: () => void) => () => void} onView
 * @property {(fn: () => void) => () => void} onSelect
 *
 * @typedef {{title: string, bounds: [number, number, number, number] | null}} Options
 */

/**
 * @param {MapCanvas} map
 * @param {Options} options
 * @param {(message: Record<string, unknown>) => void} send
 */
export default function attach(map, options, send) {
  const ending = new AbortController();
  const { signal } = ending;
  document.title = options.title;
  const offs = [
    keepSizes(map),
    showConnection(map.drive),
    listenToActions(map, send, signal),
    nameSheet(map),
    spreadNames(map),
    listenToHelp(map.drive, signal),
  ];
  listenToTools(map, options, signal);
  listenToSearch(signal);
  listenToList(map, signal);
  listenToSheet(signal);
  return {
    destroy() {
      ending.abort();
      for (const off of offs) off();
    },
  };
}
