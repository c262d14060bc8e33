// Pointer, wheel, fingers and keys → motions of the camera, in units of the picture's height.

// One notch of a wheel is about 100 of the browser's pixels: a fifth nearer.
const ZOOM_PER_PX = 0.002;
// Firefox counts lines, three to a notch, where it is asked for no pixels.
const PX_PER_LINE = 33;
// What a touchpad's pinch is reported as: a wheel with the control key, in steps of a few pixels.
const PINCH_PER_PX = 0.01;
// Distances to the target per second, slow and with shift.
const FLY_PER_SEC = [0.8, 3.0];
// A stall must not become a leap.
const LONGEST_STEP_SECS = 0.1;
const FLY_KEYS = { KeyD: [0, 1], KeyA: [0, -1], KeyE: [1, 1], KeyQ: [1, -1], KeyS: [2, 1], KeyW: [2, -1] };

/** Calls `move(motion, when)` with some of `orbit: [x, y]`, `pan: [x, y]`, `zoom: factor`, `fly: [right, up, back]`. */
export class Hands {
  #canvas;
  #move;
  #pointers = new Map();
  #held = new Set();
  #lastFlight = null;
  #fast = false;

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

  /** A key went down or up. Returns whether it is one of those that fly. */
  key(event, isDown) {
    this.#fast = event.shiftKey;
    if (!(event.code in FLY_KEYS)) return false;
    if (!isDown) this.#held.delete(event.code);
    else if (!event.ctrlKey && !event.metaKey && !event.altKey) this.#take(event);
    return true;
  }

  #take(event) {
    const rested = this.#held.size === 0;
    this.#held.add(event.code);
    if (!rested) return;
    this.#lastFlight = event.timeStamp;
    requestAnimationFrame((now) => this.#fly(now));
  }

  #fly(now) {
    if (this.#held.size === 0) return;
    const secs = Math.min(Math.max(0, now - this.#lastFlight) / 1000, LONGEST_STEP_SECS);
    this.#lastFlight = now;
    const fly = [0, 0, 0];
    for (const code of this.#held) {
      const [axis, way] = FLY_KEYS[code];
      fly[axis] += way * FLY_PER_SEC[Number(this.#fast)] * secs;
    }
    if (fly.some((step) => step !== 0)) this.#move({ fly }, now);
    requestAnimationFrame((later) => this.#fly(later));
  }
}
