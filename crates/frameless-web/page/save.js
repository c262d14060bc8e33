// The picture as a PNG, and recordings, as files of the user's.

import { fileName } from "./format.js";

let number = 0;

/** Hands bytes to the browser as a download. Names are counted, so that none replaces another of this page. */
export function download(blob, scene, ending) {
  number++;
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = fileName(scene, number, ending);
  link.click();
  // The browser has begun to read it by then.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  return link.download;
}
