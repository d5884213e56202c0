import { readStored, store } from "../../web/stored.js";
import { html, setText } from "../../web/tools/elements.js";

/**
 * Signals for people who do not look at the list: a sound, and a notification of the
 * browser.
 */

/** The key of the choices in this browser's storage. */
const KEPT = "webmap.alerts";

/** Least milliseconds between two signals. */
const APART = 3000;

/** Frequencies of the tones in Hz, and the duration of each in seconds. */
const TONES = [880, 660];
const TONE = 0.18;

/** Decides when new alerts are signalled: each once, at most one signal in 3 s. */
export class Pace {
  constructor() {
    /** @type {Set<number> | null} The signalled alerts; null before the first list. */
    this._known = null;
    this._last = -Infinity;
  }

  /**
   * @param {number[]} ids The alerts that nobody has acknowledged.
   * @param {number} now In milliseconds.
   * @returns {number[]} The alerts to signal now; none of the first list.
   */
  due(ids, now) {
    const known = this._known;
    const fresh = known === null ? [] : ids.filter((id) => !known.has(id));
    if (fresh.length > 0 && now - this._last < APART) return [];
    if (fresh.length > 0) this._last = now;
    this._known = new Set(ids);
    return fresh;
  }
}

/** The two signals, with a switch for each. */
export class Signals {
  constructor() {
    const { sound, notify } = readStored(KEPT) ?? {};
    /** @type {AudioContext | null} null until a press or a signal. */
    this._audio = null;
    /** Whether the browser allows sound, which it does after a press. */
    this._mayPlay = navigator.userActivation?.hasBeenActive ?? false;
    this._sound = html("input", "", { type: "checkbox" });
    this._sound.checked = sound !== false;
    this._notify = html("input", "", { type: "checkbox" });
    this._notify.checked = notify === true && permission() === "granted";
    this._soundNote = html("p", "webmap-muted webmap-alert-note");
    this._notifyNote = html("p", "webmap-muted webmap-alert-note", { role: "status" });
    this._sound.addEventListener("change", () => this._keep());
    this._notify.addEventListener("change", () => void this._ask());
    this.element = html(
      "div",
      "webmap-alert-signals",
      {},
      html("label", "webmap-row", {}, this._sound, "Sound"),
      this._soundNote,
      html("label", "webmap-row", {}, this._notify, "Notification while another window is in front"),
      this._notifyNote,
    );
    this._ending = new AbortController();
    const { signal } = this._ending;
    for (const press of ["pointerup", "keydown"]) {
      document.addEventListener(press, () => this._unlock(), { signal, capture: true });
    }
    this._show();
  }

  destroy() {
    this._ending.abort();
    void this._audio?.close();
  }

  /**
   * @param {string} title
   * @param {string} body
   */
  give(title, body) {
    if (this._sound.checked && this._mayPlay) this._play((audio) => beep(audio));
    const seen = !document.hidden && document.hasFocus();
    if (!this._notify.checked || seen || permission() !== "granted") return;
    try {
      const notification = new Notification(title, { body, tag: KEPT });
      notification.addEventListener("click", () => window.focus());
    } catch {
      // Some browsers on phones accept notifications only from a service worker.
      this._notify.checked = false;
      setText(this._notifyNote, "This browser shows no notifications of pages.");
    }
  }

  /** Let the browser start sound now, because not every browser does so later. */
  _unlock() {
    if (this._mayPlay) return;
    this._play((audio) => {
      this._mayPlay = true;
      this._show();
      void audio.suspend();
    });
  }

  /** @param {(audio: AudioContext) => void} fn Called when the browser plays sound. */
  _play(fn) {
    const audio = (this._audio ??= new AudioContext());
    // Without a press it may fail or wait: the next press tries again.
    audio.resume().then(() => fn(audio), () => {});
  }

  async _ask() {
    if (this._notify.checked && permission() === "default") {
      await Notification.requestPermission();
    }
    this._notify.checked = this._notify.checked && permission() === "granted";
    this._keep();
  }

  _keep() {
    store(KEPT, { sound: this._sound.checked, notify: this._notify.checked });
    this._show();
  }

  _show() {
    const waits = this._sound.checked && !this._mayPlay;
    setText(this._soundNote, waits ? "Sound starts after the first press on the page." : "");
    const may = permission();
    this._notify.disabled = may === "missing" || may === "insecure";
    setText(this._notifyNote, REASONS[may]);
  }
}

/** @typedef {"granted" | "default" | "denied" | "insecure" | "missing"} Permission */

/** Why there are no notifications. */
const REASONS = {
  granted: "",
  default: "",
  denied:
    "The browser blocks notifications of this page. Allow them in the browser's settings for this page.",
  insecure: "Notifications need an address with https, or with localhost.",
  missing: "This browser has no notifications for pages.",
};

/** @returns {Permission} */
function permission() {
  if (!window.isSecureContext) return "insecure";
  return "Notification" in window ? Notification.permission : "missing";
}

/** @param {AudioContext} audio It rests afterwards: else the browser plays silence. */
function beep(audio) {
  const gain = audio.createGain();
  gain.gain.value = 0.2;
  gain.connect(audio.destination);
  TONES.forEach((frequency, index) => {
    const tone = audio.createOscillator();
    tone.frequency.value = frequency;
    tone.connect(gain);
    tone.start(audio.currentTime + index * TONE);
    tone.stop(audio.currentTime + (index + 1) * TONE);
    if (index === TONES.length - 1) tone.onended = () => void audio.suspend();
  });
}
