// The keys, in a dialog.

const KEYS = [
  [["left drag", "one finger", "← → ↑ ↓"], "orbit"],
  [["right drag", "two fingers", "shift + arrow"], "pan"],
  [["wheel", "pinch", "+", "−"], "zoom"],
  [["W", "A", "S", "D", "Q", "E"], "fly; with shift: fast"],
  [["double click", "Home"], "back to the scene's own camera"],
  [["space"], "play or pause"],
  [["0"], "the picture"],
  [["1", "2", "3"], "change, source age, tile probability"],
  [["4", "5", "6"], "sampling rate, learned rate, holes"],
  [["P"], "hide or show the settings"],
  [["I"], "save the server's exact picture as PNG"],
  [["R"], "record a video, or end it and download it"],
  [["drop a .glb"], "upload and open it"],
  [["Esc"], "dismiss messages and this list; keys go to the picture again"],
  [["H", "?"], "this list"],
];

/** Fills the dialog; returns what opens or closes it. */
export function begin(dialog, list, close) {
  for (const [keys, what] of KEYS) {
    const term = document.createElement("dt");
    for (const key of keys) term.append(Object.assign(document.createElement("kbd"), { textContent: key }));
    list.append(term, Object.assign(document.createElement("dd"), { textContent: what }));
  }
  close.addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close(); // the ground around it
  });
  return () => (dialog.open ? dialog.close() : dialog.showModal());
}
