// How long it takes from the hand to the eye: each numbered input against the first picture on this page that shows it.

// An input that changed nothing (a zoom at its limit) is answered by whatever moves next: that says nothing.
const GIVEN_UP_MS = 2000;
// What the HUD shows is the median of the newest.
const KEPT = 31;

export class Latency {
  #waiting = []; // [number, when it happened], oldest first
  #newest = [];
  /** Called with every measured latency in milliseconds, if set. */
  onMeasured = null;

  /** Input `number` happened at `at` (performance.now()). */
  sent(number, at) {
    this.#waiting.push([number, at]);
  }

  /** The page now shows what input `number` and all before it did. Returns whether that was news. */
  shown(number, now = performance.now()) {
    let news = false;
    while (this.#waiting.length > 0 && this.#waiting[0][0] <= number) {
      const passed = now - this.#waiting.shift()[1];
      news = true;
      if (passed < GIVEN_UP_MS) this.#keep(passed);
    }
    return news;
  }

  #keep(passed) {
    this.#newest.push(passed);
    if (this.#newest.length > KEPT) this.#newest.shift();
    this.onMeasured?.(passed);
  }

  /** Milliseconds, or null before the first. */
  median() {
    if (this.#newest.length === 0) return null;
    const sorted = [...this.#newest].sort((a, b) => a - b);
    return sorted[sorted.length >> 1];
  }

  forget() {
    this.#waiting = [];
  }
}
