// Binary messages, as docs/stream-format.md specifies them. Numbers are little-endian.

export const VERSION = 1;

const TILES = 1;
const STATUS = 2;
const ACKNOWLEDGEMENT = 16;
const TILES_HEADER = 32;
const STATUS_SIZE = 48;
const CODECS = { 1: "image/jpeg", 2: "image/png" };

/** Bytes → {type: "tiles", …} or {type: "status", …}. Throws an Error that says what is wrong with them. */
export function read(buffer) {
  if (buffer.byteLength < 2) throw new Error(`a message of ${buffer.byteLength} bytes has no type`);
  const view = new DataView(buffer);
  const [type, version] = [view.getUint8(0), view.getUint8(1)];
  if (version !== VERSION) throw new Error(`wanted version ${VERSION} of the stream, got ${version}`);
  if (type === TILES) return readTiles(view, buffer);
  if (type === STATUS) return readStatus(view);
  throw new Error(`no message has type ${type}`);
}

function readTiles(view, buffer) {
  if (view.byteLength < TILES_HEADER) throw new Error(`tiles end after ${view.byteLength} bytes`);
  const [width, height] = [view.getUint16(12, true), view.getUint16(14, true)];
  const [side, count, columns] = [16, 18, 28].map((at) => view.getUint16(at, true));
  const type = CODECS[view.getUint8(2)];
  if (!type) throw new Error(`no codec has number ${view.getUint8(2)}`);
  if (width * height * side * count * columns === 0) throw new Error("tiles without a size");
  const begin = TILES_HEADER + 2 * count;
  if (view.byteLength <= begin) throw new Error(`${count} tiles end after ${view.byteLength} bytes`);
  const tiles = Array.from({ length: count }, (_, k) => view.getUint16(TILES_HEADER + 2 * k, true));
  const [across, down] = [Math.ceil(width / side), Math.ceil(height / side)];
  const outside = tiles.find((tile) => tile >= across * down);
  if (outside !== undefined) throw new Error(`tile ${outside} of ${across} × ${down}`);
  return {
    type: "tiles",
    sequence: view.getUint32(4, true),
    generation: view.getUint32(8, true),
    width,
    height,
    side,
    picture: view.getUint32(20, true),
    input: view.getUint32(24, true),
    columns,
    tiles,
    image: new Blob([new Uint8Array(buffer, begin)], { type }),
  };
}

const OVERLAY = ["picture", "heat map", "unknown"];

function readStatus(view) {
  if (view.byteLength !== STATUS_SIZE) throw new Error(`a status of ${view.byteLength} bytes`);
  const float = (at) => view.getFloat32(at, true);
  const flags = view.getUint8(2);
  return {
    type: "status",
    moves: (flags & 1) !== 0,
    exact: (flags & 2) !== 0,
    overlay: OVERLAY[view.getUint8(3)] ?? "picture",
    samplesPerSec: float(4),
    picturesPerSec: float(8),
    meanAgeSecs: float(12),
    maxAgeSecs: float(16),
    unknown: float(20),
    sceneSecs: view.getFloat64(24, true),
    bytesPerSec: view.getUint32(32, true),
    generation: view.getUint32(36, true),
    picture: view.getUint32(40, true),
    crc: view.getUint32(44, true),
  };
}

/** The bytes that acknowledge a tiles message, and all before it. */
export function acknowledgement(sequence) {
  const view = new DataView(new ArrayBuffer(8));
  view.setUint8(0, ACKNOWLEDGEMENT);
  view.setUint8(1, VERSION);
  view.setUint32(4, sequence, true);
  return view.buffer;
}
