// CRC-32 (IEEE 802.3, reflected, as in PNG) of a picture's colours.

const TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  for (let bit = 0; bit < 8; bit++) byte = byte & 1 ? 0xedb88320 ^ (byte >>> 1) : byte >>> 1;
  return byte;
});

/** Of R, G, B of every pixel; `rgba` are bytes, and alpha is left out. */
export function ofColours(rgba) {
  let crc = -1;
  for (let i = 0; i < rgba.length; i += 4) {
    crc = TABLE[(crc ^ rgba[i]) & 255] ^ (crc >>> 8);
    crc = TABLE[(crc ^ rgba[i + 1]) & 255] ^ (crc >>> 8);
    crc = TABLE[(crc ^ rgba[i + 2]) & 255] ^ (crc >>> 8);
  }
  return ~crc >>> 0;
}
