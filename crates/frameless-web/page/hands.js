// Pointer, wheel, fingers and keys → motions of the camera, in units of the picture's height.

// One notch of a wheel is about 100 of the browser's pixels: a fifth nearer.
const ZOOM_PER_PX = 0.002;
// Firefox counts lines, three to a notch, where it is asked for no pixels.
const PX_PER_LINE = 33;
// What a touchpad's pinch is reported as: a wheel with the control key, in steps of a few pixels.
const PINCH_PER_PX = 0.01;
// Distances to the target per second, slow and with shift.
const FLY_PER_SEC = [0.8, 3.0];
// Heights of the picture per second that a key drags it: a quarter of a turn, about.
const DRAG_PER_SEC = 0.5;
// A second of zooming is a factor of two.
const ZOOM_POWER_PER_SEC = 1;
// A stall must not become a leap.
const LONGEST_STEP_SECS = 0.1;
// Which motion, along which axis, which way.
const KEYS = {
  KeyD: ["fly", 0, 1],
  KeyA: ["fly", 0, -1],
  KeyE: ["fly", 1, 1],
  KeyQ: ["fly", 1, -1],
  KeyS: ["fly", 2, 1],
  KeyW: ["fly", 2, -1],
  ArrowRight: ["drag", 0, 1],
  ArrowLeft: ["drag", 0, -1],
  ArrowDown: ["drag", 1, 1],
  ArrowUp: ["drag", 1, -1],
};
// By what is written on them: where they lie differs between keyboards. With and without shift.
const SIGNS = { "+": ["zoom", 0, -1], "=": ["zoom", 0, -1], "-": ["zoom", 0, 1], _: ["zoom", 0, 1] };

/** Calls `move(motion, when)` with some of `orbit: [x, y]`, `pan: [x, y]`, `zoom: factor`, `fly: [right, up, back]`. */
export class Hands {
  #canvas;
  #move;
  #pointers = new Map();
  #held = new Map(); // a key's place → what it does
  #lastStep = null;
  #shift = false;

  constructor(canvas, move) {
    [this.#canvas, this.#move] = [canvas, move];
    const on = (name, handler) => canvas.addEventListener(name, handler.bind(this), { passive: false });
    on("pointerdown", this.#down);
    // Moves as they happen, where the browser tells: others wait for its next refresh.
    on("onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove", this.#moved);
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) on(end, this.#up);
    on("wheel", this.#wheel);
    on("contextmenu", (event) => event.preventDefault());
    addEventListener("blur", () => this.#held.clear());
  }

  #height() {
    return Math.max(1, this.#canvas.getBoundingClientRect().height);
  }

  #down(event) {
    this.#canvas.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, button: event.button });
    this.#canvas.classList.add("held");
    if (event.button === 1) event.preventDefault(); // the middle button would begin to scroll
  }

  #up(event) {
    this.#pointers.delete(event.pointerId);
    this.#canvas.classList.toggle("held", this.#pointers.size > 0);
  }

  #moved(event) {
    const pointer = this.#pointers.get(event.pointerId);
    if (!pointer) return;
    const before = this.#fingers();
    const by = [event.clientX - pointer.x, event.clientY - pointer.y].map((way) => way / this.#height());
    [pointer.x, pointer.y] = [event.clientX, event.clientY];
    if (this.#pointers.size > 1) this.#pinched(before, this.#fingers(), event.timeStamp);
    else if (by[0] !== 0 || by[1] !== 0)
      this.#move(pointer.button === 0 ? { orbit: by } : { pan: by }, event.timeStamp);
  }

  /** Middle and distance of the first two pointers. */
  #fingers() {
    const [a, b] = this.#pointers.values();
    if (!b) return null;
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)) };
  }

  #pinched(before, after, when) {
    const pan = [after.x - before.x, after.y - before.y].map((way) => way / this.#height());
    this.#move({ pan, zoom: before.apart / after.apart }, when);
  }

  #wheel(event) {
    event.preventDefault();
    const px = event.deltaY * [1, PX_PER_LINE, this.#height()][event.deltaMode];
    const zoom = Math.exp(px * (event.ctrlKey ? PINCH_PER_PX : ZOOM_PER_PX));
    if (zoom !== 1) this.#move({ zoom }, event.timeStamp);
  }

  /** A key went down or up. Returns whether it is one of those that move the camera. */
  key(event, isDown) {
    this.#shift = event.shiftKey;
    if (!isDown) return this.#held.delete(event.code);
    const moves = KEYS[event.code] ?? SIGNS[event.key];
    if (moves === undefined || event.ctrlKey || event.metaKey || event.altKey) return false;
    const rested = this.#held.size === 0;
    this.#held.set(event.code, moves);
    if (rested) {
      this.#lastStep = event.timeStamp;
      requestAnimationFrame((now) => this.#step(now));
    }
    return true;
  }

  #step(now) {
    if (this.#held.size === 0) return;
    const secs = Math.min(Math.max(0, now - this.#lastStep) / 1000, LONGEST_STEP_SECS);
    this.#lastStep = now;
    const ways = { fly: [0, 0, 0], drag: [0, 0], zoom: [0] };
    for (const [motion, axis, way] of this.#held.values()) ways[motion][axis] += way * secs;
    const motion = {};
    const moves = (name) => ways[name].some((way) => way !== 0);
    if (moves("fly")) motion.fly = ways.fly.map((way) => way * FLY_PER_SEC[Number(this.#shift)]);
    if (moves("drag")) motion[this.#shift ? "pan" : "orbit"] = ways.drag.map((way) => way * DRAG_PER_SEC);
    if (moves("zoom")) motion.zoom = 2 ** (ways.zoom[0] * ZOOM_POWER_PER_SEC);
    if (Object.keys(motion).length > 0) this.#move(motion, now);
    requestAnimationFrame((later) => this.#step(later));
  }
}
