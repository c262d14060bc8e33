// A video of the picture, H.264 in MP4: made by the browser where it can, and by the server where it cannot.

import { download } from "./save.js";

const KINDS = ["video/mp4;codecs=avc1.640028", "video/mp4;codecs=avc1.42E01F"];
// In memory until it is downloaded; more than an hour at the usual rates.
const MOST_BYTES = 2 ** 30;

export class Recorder {
  #canvas;
  #film = null;
  #begun = 0;
  #clock = null;
  /** Called with {recording, secs} when that changes. */
  onChange = () => {};
  /** Called with (level, text). */
  onNotice = () => {};
  /** Whose name the file bears. */
  scene = "picture";

  constructor(canvas) {
    this.#canvas = canvas;
  }

  toggle() {
    if (this.#film) this.#film.stop();
    else this.#begin();
  }

  async #begin() {
    const kind = KINDS.find((kind) => globalThis.MediaRecorder?.isTypeSupported(kind));
    const film = kind ? new OwnFilm(this.#canvas, kind) : new ServersFilm();
    this.#film = film;
    this.#begun = performance.now();
    this.#tell();
    this.#clock = setInterval(() => this.#tell(), 500);
    try {
      this.#save(await film.whole());
      if (film.endedBy) this.onNotice("warning", film.endedBy);
    } catch (error) {
      this.onNotice("error", `the recording broke off: ${error.message}`);
    } finally {
      clearInterval(this.#clock);
      this.#film = null;
      this.onChange({ recording: false, secs: 0 });
    }
  }

  #tell() {
    this.onChange({ recording: true, secs: (performance.now() - this.#begun) / 1000 });
  }

  #save(parts) {
    const video = new Blob(parts, { type: "video/mp4" });
    if (video.size < SMALLEST_BYTES) {
      this.onNotice("warning", "nothing was recorded: that was too short");
      return;
    }
    const name = download(video, this.scene, "mp4");
    this.onNotice("info", `recorded ${name}, ${(video.size / 1e6).toFixed(1)} MB`);
  }
}

// A file's heads alone.
const SMALLEST_BYTES = 2000;
// At rest a canvas is not drawn to, but a video must go on.
const PICTURES_PER_SEC = 30;
// A tenth of a bit per pixel looks clean with H.264; small pictures need more for their edges.
const BITS_PER_PIXEL = 0.2;
const BITS_PER_SEC = [2e6, 40e6];

/** Of this page's canvas, by the browser's own encoder. */
class OwnFilm {
  #recorder;
  #whole;

  constructor(source, mimeType) {
    const copy = evenCanvas(source);
    const draw = () => drawInto(copy, source);
    draw();
    const painting = setInterval(draw, 1000 / PICTURES_PER_SEC);
    const stream = copy.canvas.captureStream(PICTURES_PER_SEC);
    const bits = source.width * source.height * PICTURES_PER_SEC * BITS_PER_PIXEL;
    const videoBitsPerSecond = Math.min(BITS_PER_SEC[1], Math.max(BITS_PER_SEC[0], bits));
    this.#recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond });
    this.#whole = this.#collect().finally(() => {
      clearInterval(painting);
      for (const track of stream.getTracks()) track.stop();
    });
    this.#recorder.start(1000);
  }

  #collect() {
    const recorder = this.#recorder;
    const parts = [];
    let bytes = 0;
    recorder.ondataavailable = ({ data }) => {
      parts.push(data);
      bytes += data.size;
      if (bytes > MOST_BYTES) this.stop();
    };
    return new Promise((done, failed) => {
      recorder.onstop = () => done(parts);
      recorder.onerror = ({ error }) => failed(error ?? new Error("the browser does not say why"));
    });
  }

  stop() {
    if (this.#recorder.state !== "inactive") this.#recorder.stop();
  }

  /** Its parts, once it has been stopped. */
  whole() {
    return this.#whole;
  }
}

/** A canvas whose size is even, as H.264 wants it, and stays. */
function evenCanvas({ width, height }) {
  const even = (side) => Math.max(2, side - (side % 2));
  const canvas = Object.assign(document.createElement("canvas"), { width: even(width), height: even(height) });
  return canvas.getContext("2d", { alpha: false });
}

/** Pixel by pixel; whole and smaller or larger if the picture has changed its size meanwhile. */
function drawInto(context, source) {
  const { width, height } = context.canvas;
  const spare = [source.width - width, source.height - height];
  const fits = spare.every((pixels) => pixels === 0 || pixels === 1);
  const scale = fits ? 1 : Math.min(width / source.width, height / source.height);
  context.fillRect(0, 0, width, height);
  context.drawImage(source, 0, 0, source.width * scale, source.height * scale);
}

/** Of the server's pictures, by the server's encoder; it sends the file while that grows. */
class ServersFilm {
  #stopped = false;
  /** Why it has ended before it was stopped. */
  endedBy = null;

  stop() {
    this.#stopped = true;
  }

  async whole() {
    const answer = await fetch("recording.mp4", { cache: "no-store" });
    if (!answer.ok) throw new Error((await answer.text()).trim() || `the server answers ${answer.status}`);
    const reader = answer.body.getReader();
    const parts = [];
    try {
      await this.#read(reader, parts);
    } catch (error) {
      this.endedBy = `the recording broke off, and what there was is saved: ${error.message}`;
    }
    await reader.cancel().catch(() => {}); // it may be broken
    return parts;
  }

  async #read(reader, parts) {
    for (let bytes = 0; bytes < MOST_BYTES; ) {
      const { done, value } = await reader.read();
      if (done) {
        this.endedBy = "the recording has ended: the picture has another size now";
        return;
      }
      parts.push(value);
      bytes += value.byteLength;
      // What came after the end was asked for is the piece with the end in it.
      if (this.#stopped) return;
    }
    this.endedBy = "the recording has ended: it is as long as a page can keep";
  }
}
