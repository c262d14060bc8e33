// Joins the page's parts. What travels over the connection is docs/stream-format.md's.

import { Connection } from "./connection.js";
import { Hands } from "./hands.js";
import * as help from "./help.js";
import * as hud from "./hud.js";
import { Latency } from "./latency.js";
import { Layout } from "./layout.js";
import { Messages } from "./messages.js";
import { Panel } from "./panel.js";
import { Picture } from "./picture.js";
import { VERSION } from "./protocol.js";
import { Recorder } from "./record.js";
import { download, exactPng } from "./save.js";
import * as theme from "./theme.js";
import { Transport } from "./transport.js";
import { Upload } from "./upload.js";

const byId = (id) => document.getElementById(id);
const canvas = byId("picture");

const connection = new Connection();
const messages = new Messages(byId("messages"));
const picture = new Picture(canvas);
const layout = new Layout(byId("stage"), canvas, () => sendSize());
const latency = new Latency();
const recorder = new Recorder(canvas);
const upload = new Upload(messages);
const panel = new Panel((settings) => ask({ type: "settings", ...settings }));
const transport = new Transport((message) => ask(message));
const hands = new Hands(canvas, steer);
const showKeys = help.begin(byId("keys"), byId("keys-list"), byId("keys-close"));

// What the server has said last.
let client = 0;
let state = null;
let status = null;
let scene = null;
let inputs = 0;
let exact = null;

const drives = () => state !== null && state.driver === client;
const WATCHING = "you are watching; take the controls to change anything";

/** Whether this page may change anything. Where nobody drives, whoever does something drives. */
const mayAct = () => state !== null && (state.driver === null || drives());

// ---- to the server ----

/** Whether this page may change anything; if not, it says why. */
function mayAsk() {
  if (state === null || mayAct()) return true;
  messages.info(WATCHING);
  return false;
}

/** Does something that shows in the picture; `when` it happened, if its latency is to be measured. */
function ask(message, when = null) {
  if (!mayAsk()) return;
  inputs++;
  if (connection.send({ ...message, input: inputs }) && when !== null) latency.sent(inputs, when);
}

function steer(motion, when) {
  ask({ type: "camera", ...motion }, when);
}

let askedSize = "";
let sizeLater = null;

/** Tells how many pixels there are for the picture, once the window has not changed for a moment. */
function sendSize() {
  clearTimeout(sizeLater);
  sizeLater = setTimeout(() => {
    const wanted = layout.place.map((side) => Math.min(side, 16384));
    if (askedSize === wanted.join()) return;
    if (connection.send({ type: "size", place: wanted })) askedSize = wanted.join();
  }, askedSize === "" ? 0 : 150);
}

// ---- from the server ----

const heard = {
  tiles: (message) => picture.draw(message),

  status(message) {
    status = message;
    transport.told(message.sceneSecs, message.moves);
    if (message.exact) picture.compare(message);
    showNoOverlay();
    showHud();
  },

  welcome(message) {
    if (message.version !== VERSION) {
      location.reload(); // the program has been replaced while this page was open
      return;
    }
    client = message.client;
    upload.limit = { bytes: message.upload_bytes, token: message.token };
    panel.offer(message);
    show("live", "live");
    sendSize();
  },

  scene(message) {
    scene = message;
    recorder.scene = message.name;
    document.title = `${message.name} · frameless`;
    panel.scene(message);
    transport.scene(message);
    hud.showScene(message);
  },

  state(message) {
    state = message;
    panel.show(message, mayAct());
    transport.state(message, mayAct());
    if (mayAct()) messages.forget(WATCHING);
    showDriver();
    showLoading(message.loading);
  },

  legend: (message) => hud.showLegend(message),
  notice: ({ level, text }) => messages.say(level, text),
};

connection.onMessage = (message) => heard[message.type]?.(message);
connection.onOpen = () => {
  picture.begin();
  latency.forget();
  askedSize = "";
};
connection.onLost = (reason) => {
  state = null;
  showDriver();
  byId("controls").disabled = true;
  transport.stop();
  // Every attempt that fails comes here, too: what has been found out stays written.
  if (byId("banner").hidden) sayLost(reason);
  show("lost", "connection lost");
  findOutWhy(reason);
};

function sayLost(reason) {
  showBanner(`Connection lost${reason ? ` (${reason})` : ""}. Trying again …`);
}

/** Of a WebSocket that was refused a browser tells nothing: an ordinary request is told why. */
async function findOutWhy(reason) {
  const answer = await fetch("clients", { cache: "no-store" }).catch(() => null);
  if (byId("banner").hidden) return; // it is there again
  if (answer === null) return sayLost(reason);
  if (answer.status === 403) {
    // The server has another secret: this page cannot come back by itself.
    connection.pause();
    showBanner("The server has been started anew, with another secret: open the address that it printed. (With --key-file pages come back by themselves.)", false);
    return;
  }
  const { clients, most } = await answer.json().catch(() => ({}));
  if (clients >= most) showBanner(`The server is full: as many pages as may be (${most}) are looking. Trying again …`);
}

function showBanner(text, tries = true) {
  if (byId("banner-text").textContent !== text) byId("banner-text").textContent = text;
  byId("banner-spinner").hidden = byId("banner-retry").hidden = !tries;
}

picture.onDrawn = (message) => {
  connection.acknowledge(message.sequence);
  if (exact !== null) showExact(null);
  latency.shown(message.input);
  const detail = { sequence: message.sequence, picture: message.picture, input: message.input };
  document.dispatchEvent(new CustomEvent("frameless:drawn", { detail }));
};
picture.onResized = () => layout.apply();
picture.onCompared = (same) => {
  showExact(same);
  if (same === false) startAnew("the picture differs from the server's");
};
picture.onBroken = (error) => connection.restart(`tiles could not be decoded: ${error.message}`);

let startedAnew = -Infinity;

/** All of the picture is sent again; not for ever, if that does not help. */
function startAnew(reason) {
  if (performance.now() - startedAnew < 60_000) return;
  startedAnew = performance.now();
  connection.restart(reason);
}

latency.onMeasured = (ms) => document.dispatchEvent(new CustomEvent("frameless:latency", { detail: ms }));

// ---- what is shown ----

function show(name, text) {
  byId("state").dataset.state = name;
  byId("state-text").textContent = text;
  byId("banner").hidden = name !== "lost";
  byId("stage").classList.toggle("lost", name === "lost");
}

function showExact(now) {
  exact = now;
  canvas.dataset.exact = String(now);
  hud.showExact(now);
}

function showHud() {
  if (status === null) return;
  const measured = { bytesPerSec: connection.bytesPerSec(), latencyMs: latency.median() };
  hud.show(status, [canvas.width, canvas.height], measured);
}

/** Where the sampler does not know what was asked for, the picture is shown, and it is said why. */
function showNoOverlay() {
  const is = state !== null && status.overlay === "unknown";
  const wanted = is && panel.overlayTitle(state.settings.overlay);
  hud.showNoOverlay(is ? `sampler ${state.settings.sampler} has no ${wanted}; adaptive has. This is the picture` : null);
}

function showDriver() {
  const mine = drives();
  byId("driver").classList.toggle("mine", mine);
  canvas.classList.toggle("watching", !mine);
  const others = state === null ? 0 : state.clients - 1;
  byId("driver-text").textContent = state === null ? "not connected" : whoDrives(mine, others);
  const button = byId("drive");
  button.disabled = state === null;
  button.hidden = state === null || (mine && others === 0);
  button.textContent = mine ? "Release" : "Take the controls";
  button.classList.toggle("primary", !mine);
}

function whoDrives(mine, others) {
  const watching = { 0: "", 1: "; one other watches" }[others] ?? `; ${others} others watch`;
  if (mine) return `You drive${watching}`;
  return state.driver === null ? "Nobody drives" : "Somebody else drives";
}

function showLoading(what) {
  byId("loading").hidden = what === null;
  byId("loading-text").textContent = what === null ? "" : what;
}

// ---- what the user does ----

async function savePng() {
  try {
    const name = download(await exactPng(), scene?.name ?? "picture", "png");
    messages.info(`saved ${name}`);
  } catch (error) {
    messages.error(`no picture was saved: ${error.message}`);
  }
}

function togglePanels() {
  const shown = !document.body.classList.toggle("without-panel");
  byId("panels").setAttribute("aria-pressed", String(shown));
}

function comeBack(when) {
  ask({ type: "come_back" }, when);
}

recorder.onNotice = (level, text) => messages.say(level, text);
recorder.onChange = ({ recording, secs }) => {
  byId("record").setAttribute("aria-pressed", String(recording));
  byId("record").setAttribute("aria-label", recording ? "End the recording" : "Record a video");
  byId("record-time").hidden = !recording;
  byId("record-time").textContent = `${secs.toFixed(0)} s`;
};
upload.allowed = mayAct;

const on = (id, name, handler) => byId(id).addEventListener(name, handler);
on("drive", "click", () => connection.send({ type: "drive", on: !drives() }));
on("camera", "change", () => ask({ type: "look_through", camera: Number(byId("camera").value) }));
on("scenes", "change", () => {
  const name = byId("scenes").value;
  byId("scenes").value = "";
  if (name !== "" && mayAsk()) connection.send({ type: "open", name });
});
on("home", "click", (event) => comeBack(event.timeStamp));
on("save", "click", savePng);
on("record", "click", () => recorder.toggle());
on("help", "click", () => showKeys());
on("panels", "click", togglePanels);
on("banner-retry", "click", () => connection.again());
on("picture", "dblclick", (event) => comeBack(event.timeStamp));
theme.begin(byId("theme"));

const KEYS = {
  Space: () => mayAsk() && transport.toggle(),
  KeyH: () => showKeys(),
  KeyP: togglePanels,
  KeyI: savePng,
  KeyR: () => recorder.toggle(),
  Home: (event) => comeBack(event.timeStamp),
  Escape: () => {
    messages.clear();
    toPicture();
  },
};

// Whoever has chosen with the mouse goes on with the picture; whoever came by the tab key stays at the control.
let byPointer = false;
addEventListener("pointerdown", () => (byPointer = true), true);
addEventListener("change", ({ target }) => byPointer && target.matches("select, [type=checkbox], [type=radio]") && toPicture());
// (A click that a key has made has no detail.)
addEventListener("click", ({ target, detail }) => detail > 0 && target.closest("button") && !byId("keys").open && toPicture());

function toPicture() {
  canvas.focus({ preventScroll: true });
}

/** Keys belong to the control that has the focus, where it knows what to do with them. */
function isTyping({ target, code }) {
  if (byId("keys").open) return code !== "KeyH";
  const type = target.closest?.("input, select, button")?.type;
  if (type === undefined || code === "Escape") return false;
  if (code === "Space") return type !== "range";
  const isArrow = code.startsWith("Arrow");
  if (type === "range") return isArrow || code === "Home";
  if (type === "radio") return isArrow;
  if (type === "select-one") return !byPointer;
  return type === "number";
}

addEventListener("keydown", (event) => {
  if (event.code === "Tab") byPointer = false;
  if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey) return;
  const moves = hands.key(event, true);
  const action = moves ? null : actionOf(event);
  if (!moves && !action) return;
  event.preventDefault();
  // A list would take the next key for the name of one of its entries.
  if (event.target.matches?.("select")) toPicture();
  if (action && !event.repeat) action(event);
});

function actionOf({ code, key }) {
  const digit = /^(?:Digit|Numpad)([0-6])$/.exec(code);
  if (digit) return () => mayAsk() && panel.overlay(Number(digit[1]));
  return KEYS[code] ?? (key === "?" ? showKeys : null);
}

addEventListener("keyup", (event) => hands.key(event, false));

showDriver();
showExact(null);
setInterval(showHud, 250);
connection.begin();
