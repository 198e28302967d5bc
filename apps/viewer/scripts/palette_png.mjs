// Writes small PNG files: at most 256 colours, chosen by how often they occur.
import * as zlib from 'node:zlib';

const kBits = 5; // of each channel, that are told apart

function chunk(type, data) {
  const out = Buffer.alloc(12 + data.length);
  out.writeUInt32BE(data.length, 0);
  out.write(type, 4, 'latin1');
  data.copy(out, 8);
  out.writeUInt32BE(checksum(out.subarray(4, 8 + data.length)), 8 + data.length);
  return out;
}

function checksum(bytes) {
  if (zlib.crc32) return zlib.crc32(bytes);
  let c = 0xffffffff; // Node before 20.15
  for (const b of bytes) {
    c ^= b;
    for (let k = 0; k < 8; k++) c = (c >>> 1) ^ (c & 1 ? 0xedb88320 : 0);
  }
  return (c ^ 0xffffffff) >>> 0;
}

/** `rgba`: 4 bytes a pixel, opaque. */
export function encodePng(width, height, rgba) {
  const shift = 8 - kBits,
    bins = new Map();
  const bin = (i) => ((rgba[i] >> shift) << (2 * kBits)) | ((rgba[i + 1] >> shift) << kBits) | (rgba[i + 2] >> shift);
  for (let i = 0; i < rgba.length; i += 4) {
    const key = bin(i),
      b = bins.get(key) ?? { n: 0, sum: [0, 0, 0] };
    b.n++;
    for (let k = 0; k < 3; k++) b.sum[k] += rgba[i + k];
    bins.set(key, b);
  }
  const all = [...bins].map(([key, b]) => ({ key, n: b.n, colour: b.sum.map((s) => s / b.n) }));
  const colours = medianCut(all, 256),
    index = new Map();
  for (const [c, box] of colours.entries()) for (const b of box.bins) index.set(b.key, c);
  const rows = Buffer.alloc(height * (width + 1)); // each row begins with its filter: none
  for (let y = 0, i = 0; y < height; y++) {
    for (let x = 0; x < width; x++, i += 4) rows[y * (width + 1) + 1 + x] = index.get(bin(i));
  }
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header[8] = 8; // bits
  header[9] = 3; // palette
  return Buffer.concat([
    Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'),
    chunk('IHDR', header),
    chunk('PLTE', Buffer.from(colours.flatMap((c) => c.mean.map((v) => Math.round(v))))),
    chunk('IDAT', zlib.deflateSync(rows, { level: 9 })),
    chunk('IEND', Buffer.alloc(0)),
  ]);
}

/** Splits the box of colours with the largest spread at its median until there are enough. */
function medianCut(bins, most) {
  const measure = (members) => {
    const n = members.reduce((s, b) => s + b.n, 0),
      mean = [0, 1, 2].map((k) => members.reduce((s, b) => s + b.n * b.colour[k], 0) / n);
    const spread = [0, 1, 2].map((k) => members.reduce((s, b) => s + b.n * (b.colour[k] - mean[k]) ** 2, 0));
    const axis = spread.indexOf(Math.max(...spread));
    return { bins: members, n, mean, axis, spread: members.length > 1 ? spread[axis] : 0 };
  };
  const boxes = [measure(bins)];
  while (boxes.length < most) {
    const widest = boxes.reduce((a, b) => (b.spread > a.spread ? b : a));
    if (widest.spread === 0) break;
    const near = widest.bins.filter((b) => b.colour[widest.axis] <= widest.mean[widest.axis]);
    const far = widest.bins.filter((b) => b.colour[widest.axis] > widest.mean[widest.axis]);
    if (near.length === 0 || far.length === 0) {
      widest.spread = 0;
      continue;
    }
    boxes.splice(boxes.indexOf(widest), 1, measure(near), measure(far));
  }
  return boxes;
}
