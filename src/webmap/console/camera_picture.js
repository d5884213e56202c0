/** Milliseconds after which a load that never ends holds up the next no more. */
const PATIENCE = 2000;

/**
 * The newest picture of one camera: one is loaded at a time, what comes meanwhile is
 * left out but for the newest, and what is shown knows its age.
 *
 * Times are in milliseconds of the page's own clock.
 *
 * @template T
 */
export class NewestPicture {
  /**
   * @param {(url: string) => Promise<T>} load Loads a picture whole.
   * @param {(picture: T) => void} show
   * @param {() => number} now
   */
  constructor(load, show, now = () => performance.now()) {
    this._load = load;
    this._show = show;
    this._now = now;
    this._since = now();
    /** @type {number | null} When the picture was taken that is shown. */
    this._taken = null;
    /** @type {{url: string, taken: number} | null} */
    this._next = null;
    /** Loads of another camera, and those that were given up, count no more. */
    this._number = 0;
    this._busySince = -Infinity;
  }

  /** Another camera was chosen: there is no picture of it yet. */
  restart() {
    this._number++;
    this._busySince = -Infinity;
    this._next = null;
    this._taken = null;
    this._since = this._now();
  }

  /** Whether a picture is shown. */
  get shown() {
    return this._taken !== null;
  }

  /**
   * How old the picture is that is shown; without one, for how long it was waited for.
   */
  get age() {
    return Math.max(0, this._now() - (this._taken ?? this._since));
  }

  /**
   * A picture can be had.
   *
   * @param {string} url
   * @param {number} age How old it is already.
   */
  offer(url, age) {
    this._next = { url, taken: this._now() - Math.max(0, age) };
    if (this._now() - this._busySince >= PATIENCE) this._begin();
  }

  _begin() {
    const next = this._next;
    if (next === null) return;
    this._next = null;
    this._busySince = this._now();
    const number = ++this._number;
    this._load(next.url)
      .then(
        (picture) => {
          if (number !== this._number) return;
          this._taken = next.taken;
          this._show(picture);
        },
        // It was withdrawn for a newer one, which is on its way.
        () => {},
      )
      .finally(() => {
        if (number !== this._number) return;
        this._busySince = -Infinity;
        this._begin();
      });
  }
}
