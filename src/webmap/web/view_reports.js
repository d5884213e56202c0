/** Milliseconds between two reports of a view, at least. */
export const REPORT_PERIOD = 100;

/** Has a view reported when it changed: soon, not too often, and with a frame if one comes. */
export class ViewReports {
  /** @param {() => void} report */
  constructor(report) {
    this._report = report;
    this._reported = -Infinity;
    this._changed = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this._timer = undefined;
  }

  /** There is something to report, which is the end of a frame's work. */
  note() {
    this._changed = true;
  }

  /** There is something to report, with a frame or without. */
  soon() {
    this._changed = true;
    const wait = this._reported + REPORT_PERIOD - performance.now();
    this._timer ??= setTimeout(() => this._now(), Math.max(0, wait));
  }

  /** A frame has been applied: report what changed. */
  settle() {
    if (this._changed) this._now();
  }

  /** Report nothing any more. */
  end() {
    clearTimeout(this._timer);
  }

  _now() {
    clearTimeout(this._timer);
    this._timer = undefined;
    this._changed = false;
    this._reported = performance.now();
    this._report();
  }
}
