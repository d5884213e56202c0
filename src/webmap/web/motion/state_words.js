// Made by tools/make_javascript.py from webmap/core/robot_state.py: do not edit.

/**
 * The text for each state of a robot; `{who}` is its operator. Of several that are
 * true the first one is shown.
 */
export const WORDS = Object.freeze({
  disobeying: "Does not obey: still moving",
  unreachable: "No connection: may still be moving",
  no_bridge: "No connection to the bridge",
  connecting: "Connecting",
  gone: "No pose since {since}",
  lost: "Lost: no new pose",
  down: "No connection for commands",
  unconfirmed: "STOP NOT CONFIRMED",
  stopped: "STOP active",
  blocked: "Not moving: blocked?",
  goal_failed: "Goal failed",
  battery_low: "Battery low",
  other: "Another program is driving",
  moving: "Moving, not by WebMap",
  changing: "Handing over",
  stopping: "Stopping",
  driven: "{who} is driving",
  driven_by_you: "You are driving",
  settling: "Still moving",
  navigating: "Navigating",
  navigating_held: "Navigating ({who} has control)",
  navigating_held_by_you: "Navigating (you have control)",
  barred: "Cannot be driven",
  barred_held: "Cannot be driven ({who} has control)",
  barred_held_by_you: "Cannot be driven (you have control)",
  watched: "View only",
  held: "{who} has control",
  held_by_you: "You have control",
  free: "Free",
});

/** The states that the display finds besides that of the gate. */
export const SEEN = Object.freeze([
  "disobeying",
  "unreachable",
  "no_bridge",
  "connecting",
  "gone",
  "lost",
  "down",
  "goal_failed",
  "battery_low",
  "other",
  "moving",
  "settling",
  "navigating",
]);
