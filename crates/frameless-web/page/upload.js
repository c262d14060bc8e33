// A .glb from the user's machine: chosen or dropped, sent with progress.

const byId = (id) => document.getElementById(id);

export class Upload {
  #messages;
  #request = null;
  // What was wrong the last time.
  #failed = "";
  /** What the server allows: bytes, and the token by which it knows this page. */
  limit = { bytes: 0, token: "" };
  /** Whether this page may. */
  allowed = () => false;

  constructor(messages) {
    this.#messages = messages;
    byId("file").addEventListener("change", () => {
      const [file] = byId("file").files;
      byId("file").value = ""; // the same file may be chosen again
      if (file) this.send(file);
    });
    byId("cancel-upload").addEventListener("click", () => this.#request?.abort());
    this.#listenForDrops();
  }

  /** Sends a file; what came of it is said. */
  send(file) {
    const wrong = this.#whatIsWrong(file);
    this.#messages.forget(this.#failed);
    if (wrong) {
      this.#messages.error(wrong);
      this.#failed = wrong;
      return;
    }
    const url = new URL("upload", location.href);
    url.search = new URLSearchParams({ name: file.name });
    const request = new XMLHttpRequest(); // fetch tells no progress of what is sent
    request.open("POST", url);
    request.setRequestHeader("X-Client", this.limit.token);
    request.upload.onprogress = ({ loaded, total }) => this.#progress(loaded / (total || 1));
    request.onload = () => this.#ended(request.status === 200 ? "info" : "error", request.responseText.trim());
    request.onerror = () => this.#ended("error", `${file.name} did not arrive: the connection was lost`);
    request.onabort = () => this.#ended("info", `${file.name}: cancelled`);
    this.#request = request;
    this.#progress(0);
    request.send(file);
  }

  #whatIsWrong(file) {
    if (!this.allowed()) return "take the controls first: only who drives can open a scene";
    if (this.limit.bytes === 0) return "files are not taken here";
    if (this.#request) return "one upload at a time, please";
    if (!/\.glb$/i.test(file.name))
      return `wanted a .glb, got ${file.name}; a .gltf with its files can be made one by any glTF tool`;
    const megabytes = (bytes) => `${(bytes / 2 ** 20).toFixed(0)} MiB`;
    if (file.size > this.limit.bytes)
      return `${file.name} has ${megabytes(file.size)}; the server takes at most ${megabytes(this.limit.bytes)}`;
    return null;
  }

  #progress(part) {
    byId("upload").hidden = false;
    // Sent, but not yet opened: nobody knows how long that takes.
    if (part >= 1) byId("progress").removeAttribute("value");
    else byId("progress").value = part;
  }

  #ended(level, text) {
    this.#request = null;
    byId("upload").hidden = true;
    this.#failed = level === "error" ? text : "";
    if (text) this.#messages.say(level, text);
  }

  #listenForDrops() {
    let depth = 0; // entering a child leaves its parent
    const show = (change) => {
      depth = Math.max(0, depth + change);
      byId("drop").hidden = depth === 0;
    };
    const hasFile = (event) => event.dataTransfer?.types.includes("Files");
    addEventListener("dragenter", (event) => hasFile(event) && show(1));
    addEventListener("dragleave", (event) => hasFile(event) && show(-1));
    addEventListener("dragover", (event) => hasFile(event) && event.preventDefault());
    addEventListener("drop", (event) => {
      if (!hasFile(event)) return;
      event.preventDefault();
      show(-depth);
      const [file] = event.dataTransfer.files;
      if (file) this.send(file);
    });
  }
}
