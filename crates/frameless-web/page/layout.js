// Where the picture stands: one of its pixels is a whole number of the device's, wherever it fits.

/** The place in device pixels → the picture's place in device pixels. */
export function layOut([placeWidth, placeHeight], [width, height]) {
  const fits = Math.min(placeWidth / width, placeHeight / height);
  const scale = fits >= 1 ? Math.floor(fits) : fits;
  const size = [Math.round(width * scale), Math.round(height * scale)];
  return {
    left: Math.floor((placeWidth - size[0]) / 2),
    top: Math.floor((placeHeight - size[1]) / 2),
    width: size[0],
    height: size[1],
    whole: fits >= 1,
  };
}

/** Keeps a canvas laid out in its stage; says how many device pixels the stage has when that changes. */
export class Layout {
  #stage;
  #canvas;
  #place = [1, 1];
  #onPlace;

  constructor(stage, canvas, onPlace) {
    [this.#stage, this.#canvas, this.#onPlace] = [stage, canvas, onPlace];
    const observer = new ResizeObserver(([entry]) => this.#resized(entry));
    try {
      observer.observe(stage, { box: "device-pixel-content-box" });
    } catch {
      observer.observe(stage); // Safari does not tell device pixels
    }
  }

  /** Device pixels that the stage has. */
  get place() {
    return this.#place;
  }

  #resized(entry) {
    const [box, exact] = [entry.contentBoxSize[0], entry.devicePixelContentBoxSize?.[0]];
    const near = [box.inlineSize, box.blockSize].map((side) => Math.max(1, Math.round(side * devicePixelRatio)));
    // A browser that pretends to have another screen says what its real one has.
    const told = exact && [exact.inlineSize, exact.blockSize];
    this.#place = told?.every((side, k) => Math.abs(side - near[k]) <= 2) ? told : near;
    this.apply();
    this.#onPlace(this.#place);
  }

  /** Places the canvas; to be called when its size has changed. */
  apply() {
    const canvas = this.#canvas;
    const at = layOut(this.#place, [canvas.width, canvas.height]);
    for (const side of ["left", "top", "width", "height"])
      canvas.style[side] = `${at[side] / devicePixelRatio}px`;
    canvas.classList.toggle("reduced", !at.whole);
  }
}
