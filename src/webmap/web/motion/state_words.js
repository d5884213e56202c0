// Made by tools/make_javascript.py from webmap/core/robot_state.py: do not edit.

/** What a robot is doing, in words; `{who}` is who holds or drives it. */
export const WORDS = Object.freeze({
  no_bridge: "No bridge",
  connecting: "Connecting",
  gone: "Gone since {since}",
  watched: "Watched only",
  stopped: "Stopped",
  unconfirmed: "STOP NOT CONFIRMED",
  down: "No way to drive it",
  changing: "Handing over",
  stopping: "Stopping",
  blocked: "Not moving: blocked?",
  driven: "{who} drives",
  driven_by_you: "You drive",
  navigating: "Navigating",
  navigating_held: "Navigating, {who} holds it",
  navigating_held_by_you: "Navigating, you hold it",
  settling: "Still moving",
  moving: "Moving, not by WebMap",
  barred: "Cannot be driven",
  barred_held: "Cannot be driven, {who} holds it",
  barred_held_by_you: "Cannot be driven, you hold it",
  other: "Another program drives it",
  held: "{who} holds it",
  held_by_you: "You hold it",
  free: "Free",
});
