/**
 * What the player bar decides, with the times that it is given.
 *
 * @typedef {object} Status
 * @property {string} name
 * @property {number} at The position in seconds.
 * @property {number} seconds The length of the recording.
 * @property {number} rate Seconds of the recording in a second.
 * @property {boolean} playing
 * @property {boolean} ended
 * @property {number} jumps How often the position has jumped.
 * @property {string} problem Why the rest is not played, or "".
 */

/** @typedef {'stop' | 'alarm' | 'goal' | 'result'} Kind */
/** @typedef {{at: number, kind: Kind, text: string}} Mark */
/** @typedef {{at: number, fraction: number, kind: Kind, text: string}} Group */

/** From the most to the least important: the kind of a group is its most important one. */
const KINDS = /** @type {const} */ (["stop", "alarm", "result", "goal"]);

/** Most marks whose texts a group shows. */
const TEXTS = 5;

/** Milliseconds without a status after which the replay is not connected. */
const LOST = 3000;

/** Seconds by which a position may differ from a wanted one and confirm it. */
const NEAR = 0.1;

/** Milliseconds for which a wanted position is shown while no status confirms it. */
const WANTED = 2000;

/**
 * @param {number} seconds
 * @returns {string} Minutes and seconds, and hours if there are any: `1:02:03.4`.
 */
export function clock(seconds) {
  const tenths = Math.round(Math.max(seconds, 0) * 10);
  const hours = Math.floor(tenths / 36000);
  const minutes = Math.floor(tenths / 600) % 60;
  const rest = ((tenths % 600) / 10).toFixed(1).padStart(4, "0");
  return hours > 0 ? `${hours}:${`${minutes}`.padStart(2, "0")}:${rest}` : `${minutes}:${rest}`;
}

/** The position between two messages, and after an input that has no answer yet. */
export class Position {
  constructor() {
    /** @type {Status | null} */
    this.status = null;
    this._received = -Infinity;
    /** @type {{at: number, since: number, jumps: number} | null} */
    this._wanted = null;
  }

  /**
   * @param {Status} status
   * @param {number} now In milliseconds.
   */
  receive(status, now) {
    this.status = status;
    this._received = now;
    const wanted = this._wanted;
    if (wanted === null || status.jumps === wanted.jumps) return;
    // Keys come faster than answers: the answer to the key before is 1 s away from this.
    const played = status.playing ? (status.rate * (now - wanted.since)) / 1000 : 0;
    const beyond = status.at - wanted.at;
    if (beyond >= -NEAR && beyond <= played + NEAR) this._wanted = null;
  }

  /**
   * Show a position that the operator wants, until the replay is there.
   *
   * @param {number} at
   * @param {number} now
   * @returns {number} The position within the recording.
   */
  want(at, now) {
    const inside = Math.min(Math.max(at, 0), this.status?.seconds ?? 0);
    this._wanted = { at: inside, since: now, jumps: this.status?.jumps ?? 0 };
    return inside;
  }

  /**
   * @param {number} now
   * @returns {number} The position to show, in seconds.
   */
  at(now) {
    if (this._wanted !== null && now - this._wanted.since < WANTED) return this._wanted.at;
    if (this.status === null) return 0;
    const { at, seconds, rate, playing } = this.status;
    const passed = playing ? Math.min(now - this._received, 1000) / 1000 : 0;
    return Math.min(at + passed * rate, seconds);
  }

  /**
   * @param {number} now
   * @returns {boolean} Whether the replay was connected and is not any more.
   */
  lost(now) {
    return this.status !== null && now - this._received > LOST;
  }
}

/**
 * Join marks that would cover one another.
 *
 * @param {Mark[]} marks
 * @param {number} seconds The length of the recording.
 * @param {number} least Least distance of two groups, in parts of the time line.
 * @returns {Group[]} In the order of time; each begins with its first mark.
 */
export function groupMarks(marks, seconds, least) {
  /** @type {Mark[][]} */
  const groups = [];
  for (const mark of [...marks].sort((a, b) => a.at - b.at)) {
    const last = groups.at(-1);
    if (last && mark.at - last[0].at < least * seconds) last.push(mark);
    else groups.push([mark]);
  }
  return groups.map((group) => {
    const lines = group.slice(0, TEXTS).map(({ at, text }) => `${clock(at)} ${text}`);
    if (group.length > TEXTS) lines.push(`and ${group.length - TEXTS} more`);
    const kind = KINDS.find((each) => group.some((mark) => mark.kind === each)) ?? "alarm";
    const { at } = group[0];
    return { at, fraction: seconds > 0 ? at / seconds : 0, kind, text: lines.join("\n") };
  });
}
