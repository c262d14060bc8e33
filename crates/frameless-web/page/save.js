// The picture as a PNG, and recordings, as files of the user's.

import { fileName } from "./format.js";

let number = 0;

// The server makes few pictures at a time, and says when it is busy.
const ATTEMPTS = 5;
const BETWEEN_ATTEMPTS_MS = 1000;

/** The server's own picture as a PNG: what this page shows is not exact while something moves. Throws an Error that says why there is none. */
export async function exactPng() {
  for (let attempt = 1; ; attempt++) {
    const answer = await fetch("picture.png", { cache: "no-store" }).catch(() => null);
    if (answer?.ok) return answer.blob();
    if (answer?.status !== 503 || attempt === ATTEMPTS) throw new Error(await reason(answer));
    await new Promise((done) => setTimeout(done, BETWEEN_ATTEMPTS_MS));
  }
}

async function reason(answer) {
  if (answer === null) return "the server does not answer";
  return (await answer.text()).trim() || `the server answers ${answer.status}`;
}

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
