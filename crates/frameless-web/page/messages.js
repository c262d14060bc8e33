// What happened, said over the picture: the newest few, errors for longer.

// Long enough to read a sentence, and for somebody who looked away.
const STAYS_MS = { info: 6000, warning: 12_000, error: 30_000 };
// More would hide the picture.
const MOST = 4;

export class Messages {
  #place;

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

  clear() {
    this.#place.replaceChildren();
  }

  #say(text, level) {
    // What is said again is no second line.
    for (const old of this.#place.children) if (old.dataset.text === text) old.remove();
    while (this.#place.children.length >= MOST) this.#place.firstElementChild.remove();
    const line = document.createElement("div");
    line.className = `message ${level}`;
    line.dataset.text = text;
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: "×" });
    button.setAttribute("aria-label", "Dismiss");
    button.addEventListener("click", () => line.remove());
    line.append(Object.assign(document.createElement("span"), { textContent: text }), button);
    this.#place.append(line);
    setTimeout(() => line.remove(), STAYS_MS[level]);
  }
}
