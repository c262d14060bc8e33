// The bar below the picture: play, scrub, speed.

import { fill } from "./panel.js";

const byId = (id) => document.getElementById(id);
// The server tells the scene's time four times a second; between that the page counts on, this often.
const TICK_MS = 66;
// While the user scrubs, what the server says is a moment behind.
const HANDS_OFF_MS = 500;

export class Transport {
  #send;
  #duration = 0;
  #playing = true;
  #speed = 1;
  #told = { secs: 0, at: 0, moves: false };
  #touched = -Infinity;

  /** `send(message)` asks the server. */
  constructor(send) {
    this.#send = send;
    byId("play").addEventListener("click", () => this.toggle());
    byId("scrub").addEventListener("input", () => this.#scrubbed());
    byId("speed").addEventListener("change", () => this.#hurry());
    byId("speed").addEventListener("keydown", ({ key }) => key === "Enter" && byId("speed").blur());
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    setInterval(() => !calm.matches && this.#tick(), TICK_MS);
  }

  toggle() {
    this.#send({ type: "play", on: !this.#playing });
  }

  /** `duration_secs`: 0 where nothing moves, null where time goes on without end: then there is nothing to scrub. */
  scene({ duration_secs: duration }) {
    this.#duration = duration ?? Infinity;
    byId("time").hidden = !(this.#duration > 0);
    byId("timeless").hidden = this.#duration > 0;
    byId("scrub").hidden = duration === null;
    byId("play").hidden = duration === 0;
    byId("scrub").max = duration > 0 ? duration : 1;
    this.#write(this.#told.secs);
  }

  state({ playing, speed }, mayAct) {
    [this.#playing, this.#speed] = [playing, speed];
    byId("play").classList.toggle("paused", !playing);
    byId("play").setAttribute("aria-label", playing ? "Pause" : "Play");
    if (document.activeElement !== byId("speed")) byId("speed").value = speed;
    for (const id of ["play", "scrub", "speed"]) byId(id).disabled = !mayAct;
  }

  /** Nobody knows how time goes on. */
  stop() {
    this.#told = { ...this.#told, moves: false };
    for (const id of ["play", "scrub", "speed"]) byId(id).disabled = true;
  }

  /** The scene's time, as the server has it now. */
  told(secs, moves) {
    this.#told = { secs, at: performance.now(), moves };
    this.#tick();
  }

  #tick() {
    const now = performance.now();
    if (now - this.#touched < HANDS_OFF_MS) return;
    const passed = this.#told.moves ? (this.#speed * (now - this.#told.at)) / 1000 : 0;
    this.#write(this.#told.secs + passed);
  }

  #write(secs) {
    if (!(this.#duration > 0)) return;
    const isEndless = this.#duration === Infinity;
    const at = isEndless ? secs : ((secs % this.#duration) + this.#duration) % this.#duration;
    if (!isEndless) byId("scrub").value = at;
    this.#writeClock(at);
  }

  #writeClock(at) {
    fill(byId("scrub"));
    const end = this.#duration === Infinity ? "" : ` / ${this.#duration.toFixed(2)}`;
    const written = `${at.toFixed(2)}${end} s`;
    if (byId("clock").textContent === written) return;
    byId("clock").textContent = written;
    byId("scrub").setAttribute("aria-valuetext", `${at.toFixed(2)} seconds`);
  }

  #scrubbed() {
    const at = Number(byId("scrub").value);
    this.#touched = performance.now();
    this.#told = { ...this.#told, secs: at, at: this.#touched };
    this.#writeClock(at);
    this.#send({ type: "seek", secs: at });
  }

  #hurry() {
    const field = byId("speed");
    const wanted = Number.parseFloat(field.value);
    if (!Number.isFinite(wanted)) field.value = this.#speed;
    else this.#send({ type: "speed", speed: Math.min(100, Math.max(-100, wanted)) });
  }
}
