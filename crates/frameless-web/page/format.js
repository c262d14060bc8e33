// Numbers as people read them; the same words as in the window.

/** 1234567.8 → "1,234,568". What is no number is 0. */
export function grouped(number) {
  const whole = Number.isFinite(number) ? Math.max(0, Math.round(number)) : 0;
  return String(whole).replace(/\B(?=(\d{3})+$)/g, ",");
}

/** Seconds → "114 ms", or whole seconds from ten on. */
export function millis(secs) {
  if (!Number.isFinite(secs)) return "–";
  return secs >= 10 ? `${grouped(secs)} s` : `${grouped(1000 * secs)} ms`;
}

/** Bytes per second → "84 B/s", "212 kB/s", "1.25 MB/s" (1 kB is 1000 bytes). */
export function bytesPerSec(rate) {
  if (!(rate >= 1000)) return `${Math.round(rate || 0)} B/s`;
  return rate >= 1e6 ? `${(rate / 1e6).toFixed(2)} MB/s` : `${Math.round(rate / 1e3)} kB/s`;
}

/** 900000 → "900 k". */
export function metric(number) {
  if (number >= 1e6) return `${(number / 1e6).toFixed(2)} M`;
  return number >= 1e3 ? `${Math.round(number / 1e3)} k` : String(Math.round(number));
}

/** 0.00025 → "2.5e-4", 12.5 → "12.5": three digits at most, as the window's legend writes them. */
export function tick(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  const written = size < 1e-3 || size >= 1e4 ? value.toExponential(2) : value.toPrecision(3);
  const [digits, power] = written.split("e");
  const short = digits.includes(".") ? digits.replace(/\.?0+$/, "") : digits;
  return power === undefined ? short : `${short}e${Number(power)}`;
}

/** Cuts a text that a file may have made long. */
export function shortened(text, longest = 80) {
  const characters = [...text];
  return characters.length <= longest ? text : characters.slice(0, longest - 1).join("") + "…";
}

/** "a/b c.glb", 3, "png" → "frameless-a-b-c.glb-0003.png", as the window names its pictures. */
export function fileName(scene, number, ending) {
  const safe = scene.replace(/[^\p{L}\p{N}.]/gu, "-") || "picture";
  return `frameless-${safe}-${String(number).padStart(4, "0")}.${ending}`;
}
