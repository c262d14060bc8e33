// What is written over the picture: how fast, how old, how near, and what there is to know about the scene.

import { bytesPerSec, grouped, millis, shortened, tick } from "./format.js";

const byId = (id) => document.getElementById(id);

function write(id, text) {
  const place = byId(id);
  if (place.textContent !== text) place.textContent = text;
}

/** Shows a status message and what this page has measured itself. */
export function show(status, [width, height], measured) {
  byId("hud").hidden = false;
  write("hud-samples", grouped(status.samplesPerSec));
  write("hud-pictures", status.picturesPerSec.toFixed(0));
  write("hud-age", millis(status.meanAgeSecs));
  write("hud-oldest", `  max ${millis(status.maxAgeSecs)}`);
  const covers = status.samplesPerSec > 0 ? ` in ${millis((width * height) / status.samplesPerSec)}` : ", no samples";
  write("hud-covers", `${width}×${height}${covers}`);
  write("hud-holes", `${(100 * status.unknown).toFixed(1)} %`);
  write("hud-bytes", bytesPerSec(measured.bytesPerSec));
  write("hud-latency", measured.latencyMs === null ? "–" : `${Math.round(measured.latencyMs)} ms`);
}

/** Whether the canvas equals the server's picture: true, false, or null while that is open. */
export function showExact(exact) {
  write("hud-exact", exact === null ? "following" : exact ? "bit-exact" : "differs");
}

/** Notes of the scene, and how many warnings it has. */
export function showScene({ notes, warnings }) {
  const counted = { 0: [], 1: ["1 warning"] }[warnings.length] ?? [`${warnings.length} warnings`];
  const lines = [...notes.map((note) => shortened(note)), ...counted];
  byId("hud-notes").replaceChildren(...lines.map((line) => {
    return Object.assign(document.createElement("li"), { textContent: line });
  }));
  byId("hud-notes").title = warnings.join("\n");
}

/** Says that an overlay was asked for which the sampler does not know; hidden without a text. */
export function showNoOverlay(text) {
  byId("no-overlay").hidden = text === null;
  write("no-overlay", text ?? "");
}

/** What an overlay's colours mean; hidden without a title. */
export function showLegend({ title, ticks, colours, names }) {
  byId("legend").hidden = title === undefined;
  if (title === undefined) return;
  write("legend-title", title);
  byId("legend-colours").replaceChildren(...(names ? [named(names)] : scale(ticks, colours)));
}

const rgb = (colour) => `rgb(${colour.slice(0, 3).join(" ")})`;

function scale(ticks, colours) {
  const bar = Object.assign(document.createElement("div"), { className: "colours" });
  bar.style.backgroundImage = `linear-gradient(to right, ${colours.map(rgb).join(", ")})`;
  const numbers = Object.assign(document.createElement("div"), { className: "numbers" });
  for (const [at, value] of ticks) {
    const number = Object.assign(document.createElement("span"), { textContent: tick(value) });
    number.style.left = `${100 * at}%`;
    numbers.append(number);
  }
  return [bar, numbers];
}

function named(names) {
  const list = Object.assign(document.createElement("div"), { className: "names" });
  for (const { colour, name } of names) {
    const swatch = document.createElement("i");
    swatch.style.backgroundColor = rgb(colour);
    const entry = document.createElement("span");
    entry.append(swatch, name);
    list.append(entry);
  }
  return list;
}
