// Where the cells of each body lie, as a Body message has it: origin, 0, axes (columns), edge lengths of a cell, metres.

/** Numbers per frame. */
export const kFrameFloats = 16;

export const frameOrigin = (frames: Float32Array, f: number): Float32Array =>
  frames.subarray(kFrameFloats * f, kFrameFloats * f + 3);
export const frameAxes = (frames: Float32Array, f: number): Float32Array =>
  frames.subarray(kFrameFloats * f + 4, kFrameFloats * f + 13);
export const cellSize = (frames: Float32Array, f: number): Float32Array =>
  frames.subarray(kFrameFloats * f + 13, kFrameFloats * f + 16);

/** One frame: origin, axes as columns one after the other, and cell size. */
export function makeFrame(origin: ArrayLike<number>, axes: ArrayLike<number>, size: ArrayLike<number>): Float32Array {
  const out = new Float32Array(kFrameFloats);
  out.set(origin, 0);
  out.set(axes, 4);
  out.set(size, 13);
  return out;
}
