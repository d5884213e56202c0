/** Milliseconds after which an unfinished load no longer blocks the next. */
const PATIENCE = 2000;

/**
 * The newest picture of one camera. One picture is loaded at a time; of the pictures
 * that arrive meanwhile only the newest is loaded. The age of the shown picture is
 * known.
 *
 * Times are in milliseconds of the page's own clock.
 *
 * @template T
 */
export class NewestPicture {
  /**
   * @param {(url: string) => Promise<T>} load Loads a whole picture.
   * @param {(picture: T) => void} show
   * @param {() => number} now
   */
  constructor(load, show, now = () => performance.now()) {
    this._load = load;
    this._show = show;
    this._now = now;
    this._since = now();
    /** @type {number | null} Time when the shown picture was taken. */
    this._taken = null;
    /** @type {{url: string, taken: number} | null} */
    this._next = null;
    /** Identifies the current load; results of earlier loads are ignored. */
    this._number = 0;
    this._busySince = -Infinity;
  }

  /** Begin again without a picture, for another camera. */
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

  /** Age of the shown picture; without a picture, the waiting time. */
  get age() {
    return Math.max(0, this._now() - (this._taken ?? this._since));
  }

  /**
   * Offer a new picture.
   *
   * @param {string} url
   * @param {number} age Its age already.
   */
  offer(url, age) {
    this._next = { url, taken: this._now() - Math.max(0, age) };
    if (this._now() - this._busySince >= PATIENCE) this._begin();
  }

  /**
   * Note that a picture is shown that came in another way.
   *
   * @param {number} taken When it was taken.
   */
  shows(taken) {
    this._taken = taken;
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
        // The display replaced it by a newer picture, which is on its way.
        () => {},
      )
      .finally(() => {
        if (number !== this._number) return;
        this._busySince = -Infinity;
        this._begin();
      });
  }
}
