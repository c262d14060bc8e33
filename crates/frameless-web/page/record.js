// A video of what the page shows: H.264 in MP4 where the browser can, WebM where it cannot.

import { download } from "./save.js";

// The first that the browser offers. The first two are H.264 and play everywhere.
const KINDS = ["video/mp4;codecs=avc1.640028", "video/mp4;codecs=avc1.42E01F", "video/webm;codecs=vp9", "video/webm"];
// At rest a canvas is not drawn to, but a video must go on.
const PICTURES_PER_SEC = 30;
// A tenth of a bit per pixel looks clean with H.264; small pictures need more for their edges.
const BITS_PER_PIXEL = 0.2;
const BITS_PER_SEC = [2e6, 40e6];
// In memory until it is downloaded; more than an hour at the usual rates.
const MOST_BYTES = 2 ** 30;

export class Recorder {
  #source;
  #recorder = null;
  #paint = null;
  #begun = 0;
  /** Called with {recording, secs} when that changes. */
  onChange = () => {};
  /** Called with (level, text). */
  onNotice = () => {};
  /** Whose name the file bears. */
  scene = "picture";

  constructor(source) {
    this.#source = source;
  }

  get running() {
    return this.#recorder !== null;
  }

  toggle() {
    if (this.running) this.#recorder.stop();
    else this.#begin();
  }

  #begin() {
    const mimeType = KINDS.find((kind) => globalThis.MediaRecorder?.isTypeSupported(kind));
    if (!mimeType) {
      this.onNotice("error", "this browser records no video");
      return;
    }
    const stream = this.#copied();
    const { width, height } = this.#source;
    const bits = width * height * PICTURES_PER_SEC * BITS_PER_PIXEL;
    const videoBitsPerSecond = Math.min(BITS_PER_SEC[1], Math.max(BITS_PER_SEC[0], bits));
    this.#recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond });
    this.#collect(stream, mimeType.split(";")[0]);
    this.#begun = performance.now();
    this.#recorder.start(1000);
    this.onChange({ recording: true, secs: 0 });
    if (!mimeType.startsWith("video/mp4")) this.onNotice("info", "this browser records no MP4: the video will be WebM");
  }

  /** The picture on a canvas of its own, whose size is even and stays, as H.264 wants it. */
  #copied() {
    const even = (side) => Math.max(2, side - (side % 2));
    const copy = Object.assign(document.createElement("canvas"), {
      width: even(this.#source.width),
      height: even(this.#source.height),
    });
    const context = copy.getContext("2d", { alpha: false });
    const draw = () => {
      // Pixel by pixel, unless the picture has changed its size meanwhile.
      const { width, height } = this.#source;
      const scale = width - copy.width <= 1 && height - copy.height <= 1 && width >= copy.width && height >= copy.height
        ? 1
        : Math.min(copy.width / width, copy.height / height);
      context.fillRect(0, 0, copy.width, copy.height);
      context.drawImage(this.#source, 0, 0, width * scale, height * scale);
      this.onChange({ recording: this.running, secs: (performance.now() - this.#begun) / 1000 });
    };
    draw();
    this.#paint = setInterval(draw, 1000 / PICTURES_PER_SEC);
    return copy.captureStream(PICTURES_PER_SEC);
  }

  #collect(stream, type) {
    const parts = [];
    let bytes = 0;
    this.#recorder.ondataavailable = ({ data }) => {
      parts.push(data);
      bytes += data.size;
      if (bytes > MOST_BYTES && this.#recorder?.state === "recording") this.#recorder.stop();
    };
    this.#recorder.onerror = ({ error }) => this.onNotice("error", `the recording broke off: ${error?.message ?? "unknown"}`);
    this.#recorder.onstop = () => {
      clearInterval(this.#paint);
      for (const track of stream.getTracks()) track.stop();
      this.#recorder = null;
      this.onChange({ recording: false, secs: 0 });
      if (bytes === 0) return;
      const name = download(new Blob(parts, { type }), this.scene, type.split("/")[1]);
      this.onNotice("info", `recorded ${name}, ${(bytes / 1e6).toFixed(1)} MB`);
    };
  }
}
