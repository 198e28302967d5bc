// Tileable solid noise: what all procedural textures are made of.
import {
  Data3DTexture,
  DataUtils,
  HalfFloatType,
  LinearFilter,
  RGBAFormat,
  RepeatWrapping,
  UnsignedByteType,
} from 'three';

/** Small repeatable generator of pseudo-random numbers in [0, 1). */
export function random(seed: number): () => number {
  let s = seed >>> 0;
  return () => {
    s = (s + 0x6d2b79f5) >>> 0;
    let t = Math.imul(s ^ (s >>> 15), s | 1);
    t = (t + Math.imul(t ^ (t >>> 7), t | 61)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

/** Adds gradient noise of `period` lattice cells across the cube of n^3 samples, scaled by `weight`. */
function addGradientNoise(out: Float32Array, n: number, period: number, seed: number, weight: number): void {
  const next = random(seed);
  const gradients = new Float32Array(3 * period ** 3);
  for (let i = 0; i < gradients.length; i += 3) {
    const z = 2 * next() - 1,
      a = 2 * Math.PI * next(),
      r = Math.sqrt(1 - z * z);
    gradients[i] = r * Math.cos(a);
    gradients[i + 1] = r * Math.sin(a);
    gradients[i + 2] = z;
  }
  const cell = new Int32Array(n),
    far = new Int32Array(n),
    t = new Float32Array(n),
    fade = new Float32Array(n);
  for (let i = 0; i < n; i++) {
    const x = (i * period) / n,
      c = Math.floor(x),
      f = x - c;
    cell[i] = c;
    far[i] = (c + 1) % period;
    t[i] = f;
    fade[i] = f * f * f * (f * (6 * f - 15) + 10);
  }
  const dot = (ix: number, iy: number, iz: number, x: number, y: number, z: number): number => {
    const g = 3 * ((iz * period + iy) * period + ix);
    return gradients[g]! * x + gradients[g + 1]! * y + gradients[g + 2]! * z;
  };
  let o = 0;
  for (let k = 0; k < n; k++) {
    const z0 = cell[k]!,
      z1 = far[k]!,
      z = t[k]!,
      fz = fade[k]!;
    for (let j = 0; j < n; j++) {
      const y0 = cell[j]!,
        y1 = far[j]!,
        y = t[j]!,
        fy = fade[j]!;
      for (let i = 0; i < n; i++, o++) {
        const x0 = cell[i]!,
          x1 = far[i]!,
          x = t[i]!,
          fx = fade[i]!;
        const a = dot(x0, y0, z0, x, y, z),
          b = dot(x1, y0, z0, x - 1, y, z);
        const c = dot(x0, y1, z0, x, y - 1, z),
          d = dot(x1, y1, z0, x - 1, y - 1, z);
        const e = dot(x0, y0, z1, x, y, z - 1),
          f = dot(x1, y0, z1, x - 1, y, z - 1);
        const g = dot(x0, y1, z1, x, y - 1, z - 1),
          h = dot(x1, y1, z1, x - 1, y - 1, z - 1);
        const ab = a + (b - a) * fx,
          cd = c + (d - c) * fx,
          ef = e + (f - e) * fx,
          gh = g + (h - g) * fx;
        const near = ab + (cd - ab) * fy,
          back = ef + (gh - ef) * fy;
        out[o]! += weight * (near + (back - near) * fz);
      }
    }
  }
}

/**
 * n^3 RGBA texture: three independent fields of 4 + 8 cells (r, g, b) and a fine one of 16 cells (a), mean
 * 0.5. Half floats, since steps of 8 bits show as stairs where a look makes an edge of a slope; `bytes` where none does: the CPU
 * as a GPU blends them faster.
 */
export function makeNoiseTexture(n: number, bytes = false): Data3DTexture {
  const data = bytes ? new Uint8Array(4 * n ** 3) : new Uint16Array(4 * n ** 3),
    field = new Float32Array(n ** 3);
  for (let channel = 0; channel < 4; channel++) {
    field.fill(0);
    if (channel < 3) {
      addGradientNoise(field, n, 4, 11 + channel, 0.75);
      addGradientNoise(field, n, 8, 31 + channel, 0.3);
    } else {
      addGradientNoise(field, n, 16, 53, 0.8);
    }
    for (let i = 0; i < field.length; i++) {
      const value = Math.max(0, Math.min(1, 0.5 + 0.575 * field[i]!));
      data[4 * i + channel] = bytes ? Math.round(255 * value) : DataUtils.toHalfFloat(value);
    }
  }
  const texture = new Data3DTexture(data, n, n, n);
  texture.format = RGBAFormat;
  texture.type = bytes ? UnsignedByteType : HalfFloatType;
  texture.wrapS = texture.wrapT = texture.wrapR = RepeatWrapping;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.generateMipmaps = false;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}
