// What happened, said over the picture: the newest few, errors for longer.

// Long enough to read a sentence, and for somebody who looked away.
const STAYS_MS = { info: 6000, warning: 12_000, error: 30_000 };
// More would hide the picture.
const MOST = 4;

export class Messages {
  #place;
  #timers = new WeakMap();

  constructor(place) {
    this.#place = place;
  }

  info(text) {
    this.#say(text, "info");
  }

  error(text) {
    this.#say(text, "error");
  }

  /** `level`: info, warning or error. */
  say(level, text) {
    this.#say(text, level in STAYS_MS ? level : "info");
  }

  /** It is no longer so. */
  forget(text) {
    this.#line(text)?.remove();
  }

  clear() {
    this.#place.replaceChildren();
  }

  #say(text, level) {
    // What is said again is no second line, and nothing new to be read aloud.
    const old = this.#line(text);
    if (old !== undefined) {
      this.#stay(old, level);
      return;
    }
    while (this.#place.children.length >= MOST) this.#place.firstElementChild.remove();
    const line = document.createElement("div");
    line.className = `message ${level}`;
    line.dataset.text = text;
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: "×" });
    button.setAttribute("aria-label", "Dismiss");
    button.addEventListener("click", () => line.remove());
    line.append(Object.assign(document.createElement("span"), { textContent: text }), button);
    this.#place.append(line);
    this.#stay(line, level);
  }

  #line(text) {
    return [...this.#place.children].find((line) => line.dataset.text === text);
  }

  #stay(line, level) {
    clearTimeout(this.#timers.get(line));
    this.#timers.set(line, setTimeout(() => line.remove(), STAYS_MS[level]));
  }
}
