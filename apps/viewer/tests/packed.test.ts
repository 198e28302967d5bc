import { deflateRawSync } from 'node:zlib';
import { describe, expect, it } from 'vitest';
import { canUnpack, Unpacker } from '../src/engine/packed';
import { kProtocolVersion, MessageType } from '../src/engine/protocol';

/** A message whose bytes after the header are `fill`. */
function message(type: number, bytes: number, fill: number): ArrayBuffer {
  const out = new Uint8Array(bytes).fill(fill),
    view = new DataView(out.buffer);
  view.setUint16(0, type, true);
  view.setUint16(2, kProtocolVersion, true);
  view.setUint32(4, bytes, true);
  return out.buffer;
}
function packed(m: ArrayBuffer, claims = m.byteLength): ArrayBuffer {
  const deflated = deflateRawSync(new Uint8Array(m)),
    out = message(MessageType.Packed, 16 + ((deflated.length + 3) & ~3), 0),
    view = new DataView(out);
  view.setUint32(8, claims, true);
  view.setUint32(12, deflated.length, true);
  new Uint8Array(out).set(deflated, 16);
  return out;
}

describe('packed messages', () => {
  const got: ArrayBuffer[] = [],
    bad: string[] = [];
  const until = async (n: number): Promise<void> => {
    while (got.length + bad.length < n) await new Promise((r) => setTimeout(r, 1));
  };
  it('come out as they were, in order, and only they are waited for', async () => {
    expect(canUnpack()).toBe(true);
    got.length = bad.length = 0;
    const unpacker = new Unpacker(
      (m) => got.push(m),
      (e) => bad.push(e.message),
    );
    const all = [3, 200_000, 40, 100_000, 50].map((n, i) => message(i + 1, 8 + n, 17 * i));
    unpacker.take(all[0]!);
    expect(got.length).toBe(1); // at once
    unpacker.take(packed(all[1]!));
    unpacker.take(all[2]!);
    unpacker.take(packed(all[3]!));
    unpacker.take(all[4]!);
    expect(got.length).toBe(1);
    await until(5);
    expect(got.map((m) => Buffer.from(m))).toEqual(all.map((m) => Buffer.from(m)));
    unpacker.take(all[0]!);
    expect(got.length).toBe(6);
    expect(bad).toEqual([]);
  });
  it('that are damaged are counted, and the next go on', async () => {
    got.length = bad.length = 0;
    const unpacker = new Unpacker(
      (m) => got.push(m),
      (e) => bad.push(e.message),
    );
    const whole = message(2, 5000, 1),
      torn = packed(whole);
    new DataView(torn).setUint32(12, 3000, true);
    const damaged = packed(whole);
    new Uint8Array(damaged).fill(255, 16);
    unpacker.take(torn);
    unpacker.take(packed(whole, 4999));
    unpacker.take(damaged);
    unpacker.take(whole);
    await until(4);
    expect(bad.length).toBe(3);
    expect(got.map((m) => Buffer.from(m))).toEqual([Buffer.from(whole)]);
  });
});
