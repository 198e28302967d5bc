import { PerspectiveCamera, Sphere, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { frameSubject, frameView, isFree, kNothingOver, type Insets } from '../src/scene/framing';
import { insetsOf } from '../src/ui/free';

const kField = 32;
const kOff = 14; // pixels: what is near is larger, and its margin too
const towards = new Vector3(-0.42, -1.18, 0.98).normalize();
function corners(x: number, y: number, z: number): Vector3[] {
  return Array.from({ length: 8 }, (_, i) => new Vector3(i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z));
}
/** Where places are in a window that looks at them. */
function seen(places: Vector3[], width: number, height: number, over: Insets, least: number): [number, number][] {
  const { position, target } = frameView(places, towards, least, { width, height, field: kField, over });
  const camera = new PerspectiveCamera(kField, width / height, 0.001, 1000);
  camera.up.set(0, 0, 1);
  camera.position.copy(position);
  camera.lookAt(target);
  camera.updateMatrixWorld();
  expect(position.clone().sub(target).normalize().distanceTo(towards)).toBeLessThan(1e-9);
  expect(position.distanceTo(target)).toBeGreaterThan(least - 1e-9);
  return places.map((p) => {
    const q = p.clone().project(camera);
    return [((q.x + 1) / 2) * width, ((1 - q.y) / 2) * height];
  });
}
const middle = (a: number[]): number => (Math.min(...a) + Math.max(...a)) / 2;

describe('the view that shows all', () => {
  it('takes in what lies beside where that is little farther away', () => {
    const places = corners(0.1, 0.1, 0.02),
      window = { width: 900, height: 600, field: kField, over: kNothingOver },
      whole = (beside: Vector3[]): number => {
        const { position, target } = frameSubject({ places, beside, ball: new Sphere() }, towards, 0.01, window);
        return position.distanceTo(target);
      };
    const alone = whole([]),
      at = (x: number): Vector3[] => [new Vector3(x, 0, 0)],
      all = (x: number): number => {
        const { position, target } = frameView(places.concat(at(x)), towards, 0.01, window);
        return position.distanceTo(target);
      };
    for (const x of [0.15, 0.2, 0.3, 0.5, 1]) expect(whole(at(x))).toBe(all(x) <= 1.4 * alone ? all(x) : alone);
    expect(all(0.15)).toBeLessThan(1.4 * alone);
    expect(all(1)).toBeGreaterThan(2 * alone);
  });
  const desk: Insets = { left: 152, top: 60, right: 0, bottom: 122 },
    phone: Insets = { left: 0, top: 118, right: 0, bottom: 224 };
  for (const [name, width, height, over] of [
    ['a desk', 1280, 720, desk],
    ['a phone', 390, 844, phone],
    ['a phone on its side', 844, 390, { left: 80, top: 110, right: 0, bottom: 64 }],
  ] as const) {
    it(`has it whole in the free part of ${name}, whatever its shape`, () => {
      for (const box of [corners(1, 1, 0.01), corners(3, 0.2, 0.1), corners(0.2, 0.2, 2), corners(0.1, 0.1, 0.1)]) {
        const at = seen(box, width, height, over, 1);
        for (const p of at) expect(isFree(p, width, height, over)).toBe(true);
        expect(Math.abs(middle(at.map((p) => p[1])) - (over.top + height - over.bottom) / 2)).toBeLessThan(kOff);
      }
    });
  }
  it('keeps to the middle from side to side where that is free, and is as far as asked', () => {
    const at = seen(corners(0.2, 0.2, 0.2), 1280, 720, desk, 4);
    expect(Math.abs(middle(at.map((p) => p[0])) - 640)).toBeLessThan(kOff);
    const wide = seen(corners(3, 0.1, 0.1), 1280, 720, desk, 1);
    expect(Math.min(...wide.map((p) => p[0]))).toBeGreaterThan(152);
  });
  it('comes as near as the window allows, and to a place from straight above', () => {
    const at = seen(corners(1, 1, 0.1), 1000, 1000, kNothingOver, 0.1),
      span = (k: 0 | 1): number => Math.max(...at.map((p) => p[k])) - Math.min(...at.map((p) => p[k]));
    expect(Math.max(span(0), span(1))).toBeCloseTo(1000 - 2 * 28, 3);
    const { position } = frameView([new Vector3(1, 2, 3)], new Vector3(0, 0, 1), 2, {
      width: 100,
      height: 100,
      field: kField,
      over: kNothingOver,
    });
    expect(position.distanceTo(new Vector3(1, 2, 5))).toBeLessThan(1e-6);
  });
  it('leaves boxes out from the side where that costs least', () => {
    const box = (left: number, top: number, right: number, bottom: number) => ({ left, top, right, bottom });
    const desk = [box(10, 10, 460, 57), box(10, 180, 152, 540), box(402, 660, 878, 710), box(495, 598, 784, 648)];
    expect(insetsOf(desk, 1280, 720)).toEqual({ left: 152, top: 57, right: 0, bottom: 122 });
    expect(insetsOf([], 1280, 720)).toEqual(kNothingOver);
  });
});
