// Made by tools/make_javascript.py: do not edit.

/** The path of WebMap's own files and sockets on the server. */
export const FOLDER = "/_webmap/";

/** The bundle with WebMap's other browser parts. */
export const PARTS = "parts.js";

/** The bundle of what is loaded when somebody uses it. */
export const LATER = "later.js";

/** The browser parts of this bundle. */
export const LATER_PARTS = Object.freeze(["features/player/player_bar.js"]);

/** Where their own modules are. */
export const PART_FOLDERS = Object.freeze(["console/", "features/"]);

/** The bundle of each browser part that a page starts with. */
export const FIRST_PARTS = Object.freeze({
  "features/stop/stop_button.js": "web/drive.js",
  "features/drive/teleop.js": "web/drive.js",
});

/** The style sheet of STOP and driving. */
export const FIRST_SHEETS = "first_parts.css";

/** The style sheet of the other parts. */
export const PART_SHEETS = "parts.css";

/** The subprotocol of both sockets. */
export const PROTOCOL = "webmap";

/** The field of a query that signs in once. */
export const CODE = "webmap_code";

/** The element and the header with the secret of a page. */
export const KEY = "webmap-key";

/** The pattern of the name that a page chooses for itself. */
export const PAGE_ID = "^[A-Za-z0-9_-]{8,64}$";

/** Characters that texts in messages to the server may have. */
export const LONGEST_TEXTS = Object.freeze({
  "name": 64,
  "value": 8192,
  "url": 500,
  "trouble": 2000,
});

/** Most elements that a page names because it does not show them. */
export const MOST_UNSEEN = 1000;

/** Close codes after which the page does not connect again. */
export const FOR_GOOD = Object.freeze([1008, 4001]);

/** Most points of a route. */
export const MOST_POINTS = 500;

/** Most characters of a route's name. */
export const LONGEST_NAME = 60;

/** Metres between robots that are sent together. */
export const SPACING = Object.freeze([0.3, 20.0]);

/** The levels of a log, the lowest first. */
export const LEVELS = Object.freeze(["debug", "info", "warn", "error", "fatal"]);

/** The alarm about a robot that zero cannot reach. */
export const MAY_MOVE = "may still be moving. Only the base's own timeout or the button on the robot can stop it";

/** The text and the shape of each state of a goal. */
export const GOALS = Object.freeze({
  "sent": ["Goal sent", "sent"],
  "accepted": ["Goal accepted", "sent"],
  "under way": ["Navigating to goal", "way"],
  "cancelling": ["Cancelling goal", "cancelled"],
  "unknown": ["State of the goal unknown", "unknown"],
  "reached": ["Goal reached", "reached"],
  "failed": ["Goal failed", "failed"],
  "cancelled": ["Goal cancelled", "cancelled"],
});

/** The text of each activity and condition of a robot, the worst first; `{who}` is its operator. */
export const WORDS = Object.freeze({
  "disobeying": "Does not obey: still moving",
  "unreachable": "No connection: may still be moving",
  "no_bridge": "No connection to the bridge",
  "connecting": "Connecting",
  "gone": "No pose since {since}",
  "lost": "Lost: no new pose",
  "down": "No connection for commands",
  "unconfirmed": "STOP NOT CONFIRMED",
  "stopped": "STOP active",
  "blocked": "Not moving: blocked?",
  "goal_failed": "Goal failed",
  "battery_low": "Battery low",
  "other": "Moved by {program}",
  "moving": "Moved by another program",
  "changing": "Handing over",
  "stopping": "Stopping",
  "driven": "{who} is driving",
  "driven_by_you": "You are driving",
  "settling": "Still moving",
  "navigating": "Autonomous",
  "navigating_held": "Autonomous ({who} has control)",
  "navigating_held_by_you": "Autonomous (you have control)",
  "barred": "Cannot be driven",
  "barred_held": "Cannot be driven ({who} has control)",
  "barred_held_by_you": "Cannot be driven (you have control)",
  "watched": "View only",
  "held": "{who} has control",
  "held_by_you": "You have control",
  "free": "Free",
});

/** The activities that the display finds besides the gate's. */
export const SEEN = Object.freeze([
  "disobeying",
  "unreachable",
  "no_bridge",
  "connecting",
  "gone",
  "lost",
  "down",
  "other",
  "moving",
  "settling",
  "navigating",
]);
