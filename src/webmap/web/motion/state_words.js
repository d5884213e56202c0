// Made by tools/make_javascript.py from webmap/core/robot_state.py: do not edit.

/** The text for each state of a robot; `{who}` is its operator. */
export const WORDS = Object.freeze({
  no_bridge: "No connection to the bridge",
  connecting: "Connecting",
  gone: "No pose since {since}",
  watched: "View only",
  stopped: "STOP active",
  unconfirmed: "STOP NOT CONFIRMED",
  down: "No connection for commands",
  changing: "Handing over",
  stopping: "Stopping",
  blocked: "Not moving: blocked?",
  driven: "{who} is driving",
  driven_by_you: "You are driving",
  navigating: "Navigating",
  navigating_held: "Navigating ({who} has control)",
  navigating_held_by_you: "Navigating (you have control)",
  settling: "Still moving",
  moving: "Moving, not by WebMap",
  barred: "Cannot be driven",
  barred_held: "Cannot be driven ({who} has control)",
  barred_held_by_you: "Cannot be driven (you have control)",
  other: "Another program is driving",
  held: "{who} has control",
  held_by_you: "You have control",
  free: "Free",
});
