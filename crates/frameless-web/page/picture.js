// The canvas: tiles are decoded side by side and drawn in order, each at once.

import { ofColours } from "./crc.js";

// A lossless picture stays so only if the browser leaves its numbers alone.
const AS_IT_IS = { colorSpaceConversion: "none", premultiplyAlpha: "none" };

export class Picture {
  #canvas;
  #context;
  #order = Promise.resolve();
  #generation = null;
  #verified = null;
  #epoch = 0;
  /** Called with every message of tiles once it is drawn. */
  onDrawn = () => {};
  /** Called when the picture has another size. */
  onResized = () => {};
  /** Called with true or false once the canvas has been compared with the server's picture. */
  onCompared = () => {};
  /** Called with what a message that could not be decoded was. */
  onBroken = () => {};

  constructor(canvas) {
    this.#canvas = canvas;
    // It is drawn to by the processor, tile by tile, and read to be compared.
    this.#context = canvas.getContext("2d", { alpha: false, willReadFrequently: true });
  }

  /** Another connection: what is still to be decoded of the last one is not drawn. */
  begin() {
    this.#epoch++;
    this.#generation = null;
    this.#verified = null;
  }

  /** Draws a message's tiles, after those of all messages before it. */
  draw(message) {
    const decoded = createImageBitmap(message.image, AS_IT_IS);
    decoded.catch(() => {}); // handled below, in order
    this.#inOrder(async () => {
      const atlas = await decoded;
      return () => this.#put(message, atlas);
    });
  }

  /** Compares the canvas with the picture of a status, once all that came before it is drawn. */
  compare({ picture, crc }) {
    this.#inOrder(async () => () => {
      if (this.#verified === picture) return;
      const { width, height } = this.#canvas;
      const same = ofColours(this.#context.getImageData(0, 0, width, height).data) === crc;
      this.#verified = same ? picture : null;
      this.onCompared(same);
    });
  }

  #inOrder(work) {
    const epoch = this.#epoch;
    this.#order = this.#order.then(async () => {
      try {
        const finish = await work();
        if (epoch === this.#epoch) finish();
      } catch (error) {
        if (epoch === this.#epoch) this.onBroken(error);
      }
    });
  }

  #put(message, atlas) {
    if (message.generation !== this.#generation) this.#resize(message);
    const across = Math.ceil(message.width / message.side);
    message.tiles.forEach((tile, k) => {
      const from = [k % message.columns, Math.floor(k / message.columns)].map((at) => at * message.side);
      const to = [tile % across, Math.floor(tile / across)].map((at) => at * message.side);
      const size = [message.width - to[0], message.height - to[1]].map((left) => Math.min(left, message.side));
      this.#context.drawImage(atlas, ...from, ...size, ...to, ...size);
    });
    atlas.close();
    this.#verified = null;
    this.onDrawn(message);
  }

  /** Takes the new size; what was there stays, scaled, until tiles come. */
  #resize({ generation, width, height }) {
    const canvas = this.#canvas;
    this.#generation = generation;
    if (canvas.width !== width || canvas.height !== height) {
      const old = new OffscreenCanvas(canvas.width, canvas.height);
      old.getContext("2d", { alpha: false }).drawImage(canvas, 0, 0);
      [canvas.width, canvas.height] = [width, height];
      this.#context.drawImage(old, 0, 0, width, height);
    }
    // One pixel becomes one pixel, whatever else is drawn.
    this.#context.imageSmoothingEnabled = false;
    this.onResized();
  }
}
