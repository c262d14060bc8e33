// The one WebSocket: begun again by itself whenever it is lost, sooner at first and later in longer steps.

import { acknowledgement, read } from "./protocol.js";

const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 1000;
// The server says something once a second at the least.
const SILENCE_MS = 5000;

export class Connection {
  #socket = null;
  #wait = FIRST_WAIT_MS;
  #retry = null;
  #heard = 0;
  #received = []; // [when, bytes] of the last second
  #token = null; // by which the server knows this page; a connection that was lost may still be there, and drive
  /** Called with {type, …}: what the server says, binary and JSON alike. */
  onMessage = () => {};
  /** Called when a connection has begun, and with a reason when it has been lost. */
  onOpen = () => {};
  onLost = () => {};

  begin() {
    setInterval(() => this.#watch(), 1000);
    for (const sign of ["online", "pageshow"]) addEventListener(sign, () => this.again());
    document.addEventListener("visibilitychange", () => document.visibilityState === "visible" && this.again());
    this.#open();
  }

  /** Try now, if there is no connection. */
  again() {
    if (this.#socket !== null) return;
    this.#wait = FIRST_WAIT_MS;
    this.#open();
  }

  /** No use in trying: until somebody calls `again`. */
  pause() {
    clearTimeout(this.#retry);
  }

  /** Give this connection up and begin another. */
  restart(reason) {
    this.#lose(reason);
  }

  /** Sends JSON; says whether there was somebody to send it to. */
  send(message) {
    return this.#write(JSON.stringify(message));
  }

  acknowledge(sequence) {
    return this.#write(acknowledgement(sequence));
  }

  #write(data) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(data);
    return true;
  }

  /** Bytes that came in the last second, as messages. */
  bytesPerSec(now = performance.now()) {
    while (this.#received.length > 0 && now - this.#received[0][0] > 1000) this.#received.shift();
    return this.#received.reduce((sum, [, bytes]) => sum + bytes, 0);
  }

  #open() {
    clearTimeout(this.#retry);
    const url = new URL("stream", location.href);
    url.protocol = url.protocol.replace("http", "ws");
    url.search = this.#token === null ? "" : new URLSearchParams({ resume: this.#token });
    url.hash = "";
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    this.#socket = socket;
    this.#heard = performance.now();
    socket.onopen = () => this.onOpen();
    socket.onmessage = ({ data }) => this.#take(socket, data);
    socket.onclose = ({ code, reason }) => {
      if (socket === this.#socket) this.#lose(reason || (code === 1006 ? "" : `code ${code}`));
    };
  }

  #take(socket, data) {
    if (socket !== this.#socket) return;
    const now = performance.now();
    const text = typeof data === "string";
    this.#heard = now;
    this.#received.push([now, text ? data.length : data.byteLength]);
    let message;
    try {
      message = text ? JSON.parse(data) : read(data);
    } catch (error) {
      this.#lose(error.message);
      return;
    }
    if (message.type === "welcome") [this.#wait, this.#token] = [FIRST_WAIT_MS, message.token];
    this.onMessage(message);
  }

  /** A connection that says nothing is lost, whatever the network thinks. */
  #watch() {
    if (this.#socket !== null && performance.now() - this.#heard > SILENCE_MS) this.#lose("the server is silent");
  }

  #lose(reason) {
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
    clearTimeout(this.#retry);
    this.#retry = setTimeout(() => this.#open(), this.#wait);
    this.#wait = Math.min(this.#wait * 1.5, LONGEST_WAIT_MS);
    this.onLost(reason);
  }
}
