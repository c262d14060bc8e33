// The settings: what the server says they are, and what the user makes of them.

import { metric } from "./format.js";

const SIZES = [
  ["window", "page, coarse if large"],
  ["whole-window", "page, every pixel"],
  ...["320x240", "512x384", "640x480", "1024x768", "1280x720", "1920x1080"].map((size) => [size, size.replace("x", " × ")]),
];
const OPTIONS = ["relight", "deep", "antialias"];
// The sketch's rate, so that ticking the box shows what it was about.
const FIRST_RATE = 900_000;
// While a control is being moved, the server's echo of where it was a moment ago must not move it back.
const HANDS_OFF_MS = 700;

const byId = (id) => document.getElementById(id);

/** Fills the part of a slider that lies before its thumb. */
export function fill(slider) {
  const [min, max] = [Number(slider.min), Number(slider.max)];
  slider.style.setProperty("--filled", `${(100 * (slider.value - min)) / (max - min || 1)}%`);
}

function option(value, text) {
  return Object.assign(document.createElement("option"), { value, textContent: text });
}

export class Panel {
  #set;
  #touched = -Infinity;
  #state = null;
  #rate = FIRST_RATE;
  #hints = new Map();
  #titles = new Map();

  /** `set(settings)` is called with those that the user has changed. */
  constructor(set) {
    this.#set = set;
    byId("size").append(...SIZES.map(([value, text]) => option(value, text)));
    this.#listen();
  }

  /** What the server offers: names of samplers, overlays and scenes. */
  offer({ samplers, tone_maps: toneMaps, overlays, scenes, upload_bytes: uploadBytes }) {
    byId("sampler").replaceChildren(...samplers.map(({ name, description }) => {
      this.#hints.set(name, description);
      return Object.assign(option(name, name), { title: description });
    }));
    byId("tone-map").replaceChildren(...toneMaps.map(({ name, description }) => {
      return Object.assign(option(name, name), { title: description });
    }));
    for (const { name, title } of overlays) this.#titles.set(name, title ?? name);
    byId("overlays").replaceChildren(...overlays.map(overlayChoice));
    const first = option("", "pick …");
    byId("scenes").replaceChildren(first, ...scenes.map(({ name, description }) => {
      return Object.assign(option(name, name), { title: description });
    }));
    byId("scenes").hidden = scenes.length === 0;
    byId("choose").hidden = uploadBytes === 0;
    byId("open").hidden = scenes.length === 0 && uploadBytes === 0;
  }

  /** The scene and its cameras. */
  scene({ name, cameras }) {
    byId("scene-name").textContent = byId("scene-name").title = name;
    const free = Object.assign(option("", "free camera"), { disabled: true });
    byId("camera").replaceChildren(free, ...cameras.map((camera, index) => option(String(index), camera)));
  }

  /** All settings as they are now. */
  show(state, mayAct) {
    this.#state = state;
    byId("controls").disabled = !mayAct;
    byId("camera").value = state.camera === null ? "" : String(state.camera);
    if (performance.now() - this.#touched > HANDS_OFF_MS) this.#apply(state.settings);
    else setTimeout(() => this.#state && this.show(this.#state, !byId("controls").disabled), HANDS_OFF_MS);
  }

  /** What the panel calls an overlay. */
  overlayTitle(name) {
    return this.#titles.get(name) ?? name;
  }

  /** Shows another overlay at once, and asks for it. */
  overlay(index) {
    const choice = byId("overlays").querySelectorAll("input")[index];
    if (!choice) return;
    choice.checked = true;
    this.#change({ overlay: choice.value });
  }

  #apply(settings) {
    byId("sampler").value = settings.sampler;
    this.#showSampler(settings.sampler);
    for (const [id, value] of Object.entries({ temporal: settings.temporal, w_d: settings.w_d, tile: settings.tile }))
      if (value !== null) slide(id, value);
    const [kind, ...options] = settings.reconstruction.split("+");
    for (const radio of document.getElementsByName("reconstruction")) radio.checked = radio.value === kind;
    if (kind === "reproject") for (const name of OPTIONS) byId(name).checked = options.includes(name);
    byId("reproject-row").hidden = kind !== "reproject";
    this.#rate = settings.samples_per_sec ?? this.#rate;
    byId("limited").checked = settings.samples_per_sec !== null;
    byId("rate").disabled = settings.samples_per_sec === null;
    slide("rate", Math.log10(this.#rate));
    slide("exposure", settings.exposure_stops);
    byId("tone-map").value = settings.tone_map;
    showSize(settings.picture);
    for (const radio of document.getElementsByName("overlay")) radio.checked = radio.value === settings.overlay;
  }

  #showSampler(name) {
    byId("sampler").title = this.#hints.get(name) ?? "";
    byId("temporal-row").hidden = name !== "adaptive";
    byId("w_d-row").hidden = byId("tile-row").hidden = name !== "change";
  }

  #change(settings) {
    this.#touched = performance.now();
    this.#set(settings);
  }

  #listen() {
    const on = (id, name, handler) => byId(id).addEventListener(name, handler);
    on("sampler", "change", () => {
      this.#showSampler(byId("sampler").value);
      this.#change({ sampler: byId("sampler").value });
    });
    for (const [id, name, value] of [
      ["temporal", "temporal", Number],
      ["w_d", "w_d", Number],
      ["tile", "tile", Number],
      ["exposure", "exposure_stops", Number],
      ["rate", "samples_per_sec", (power) => 10 ** power],
    ])
      on(id, "input", () => {
        slide(id, byId(id).value);
        this.#change({ [name]: value(byId(id).value) });
      });
    on("limited", "change", () => {
      const limited = byId("limited").checked;
      byId("rate").disabled = !limited;
      this.#change({ samples_per_sec: limited ? this.#rate : null });
    });
    on("tone-map", "change", () => this.#change({ tone_map: byId("tone-map").value }));
    on("size", "change", () => this.#change({ picture: byId("size").value }));
    for (const radio of document.getElementsByName("reconstruction"))
      radio.addEventListener("change", () => this.#reconstruct());
    for (const name of OPTIONS) on(name, "change", () => this.#reconstruct());
    on("overlays", "change", (event) => this.#change({ overlay: event.target.value }));
  }

  #reconstruct() {
    const kind = document.querySelector("[name=reconstruction]:checked")?.value ?? "reproject";
    byId("reproject-row").hidden = kind !== "reproject";
    const options = kind === "reproject" ? OPTIONS.filter((name) => byId(name).checked) : [];
    this.#change({ reconstruction: [kind, ...options].join("+") });
  }
}

const WRITTEN = {
  rate: (power) => metric(10 ** power),
  exposure: (stops) => Number(stops).toFixed(2),
  w_d: (weight) => Number(weight).toFixed(2),
  tile: (side) => `${Math.round(side)} px`,
};

/** Sets a slider, what is written beside it, and what is said of it. */
function slide(id, value) {
  const slider = byId(id);
  slider.value = value;
  fill(slider);
  const written = WRITTEN[id]?.(value);
  if (written === undefined) return;
  document.querySelector(`output[for="${id}"]`).textContent = written;
  slider.setAttribute("aria-valuetext", written);
}

/** A size that is none of those offered was asked for on the command line. */
function showSize(picture) {
  const select = byId("size");
  if (![...select.options].some(({ value }) => value === picture)) select.append(option(picture, picture.replace("x", " × ")));
  select.value = picture;
}

function overlayChoice({ name, title, description }, digit) {
  const label = Object.assign(document.createElement("label"), { title: description });
  const radio = Object.assign(document.createElement("input"), { type: "radio", name: "overlay", value: name });
  const text = Object.assign(document.createElement("span"), { textContent: title ?? name });
  const key = Object.assign(document.createElement("kbd"), { textContent: digit });
  key.setAttribute("aria-hidden", "true");
  label.append(radio, key, text);
  return label;
}
