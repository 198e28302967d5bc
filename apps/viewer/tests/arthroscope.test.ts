import { MathUtils, PerspectiveCamera, ShaderChunk, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { Arthroscope, kRound } from '../src/scene/arthroscope';
import { installNearLight } from '../src/scene/near_light';

const entry = new Vector3(0.01, 0.05, 0.02),
  target = new Vector3(0, 0.013, 0),
  angle = MathUtils.degToRad(30);
function scope(): Arthroscope {
  const s = new Arthroscope();
  s.set({ entry, target, angle });
  return s;
}
const between = (a: Vector3, b: Vector3): number => MathUtils.radToDeg(a.angleTo(b));

describe('arthroscope', () => {
  it('looks at its target to begin with, aside of its shaft', () => {
    const s = scope();
    expect(between(s.shaft(), s.view())).toBeCloseTo(30, 6);
    expect(between(s.view(), target.clone().sub(s.tip()))).toBeLessThan(1e-4);
  });
  it('keeps its angle and its entry, however it is led', () => {
    const s = scope();
    for (let i = 0; i < 200; i++) {
      s.lean(Math.sin(3 * i), Math.cos(5 * i));
      s.turn(0.3 * i);
      s.push(Math.sin(i));
      expect(between(s.shaft(), s.view())).toBeCloseTo(30, 6);
      // The entry is on the shaft, behind the tip.
      const back = entry.clone().sub(s.tip());
      expect(back.clone().cross(s.shaft()).length()).toBeLessThan(1e-12);
      expect(back.dot(s.shaft())).toBeLessThan(0);
    }
  });
  it('is nearer to its target the farther it is pushed in', () => {
    const s = scope(),
      whole = target.distanceTo(entry);
    s.lean(0, 0);
    const first = s.way;
    expect(first).toBeCloseTo(target.distanceTo(s.tip()), 12);
    s.push(0.2);
    expect(s.way).toBeLessThan(first);
    s.push(-2);
    expect(s.way).toBeGreaterThan(0.97 * whole);
  });
  it('looks around when it is turned: half a turn looks up as far as it looked down', () => {
    const s = scope(),
      down = s.view().z - s.shaft().z;
    s.turn(Math.PI);
    expect(down).toBeLessThan(0);
    expect(s.view().z - s.shaft().z).toBeGreaterThan(0);
    s.turn(Math.PI);
    expect(s.turnedBy).toBeCloseTo(0, 9);
  });
  it.each([[16 / 9], [0.5]])('shows 78 degrees across its round picture at an aspect of %d', (aspect) => {
    const s = scope(),
      camera = new PerspectiveCamera(32, aspect, 0.01, 10);
    s.place(camera, aspect, 0.05);
    camera.matrixWorldInverse.copy(camera.matrixWorld).invert();
    // A point 39 degrees aside lies on the circle's edge: kRound of the shorter half of the window.
    const half = MathUtils.degToRad(39),
      right = new Vector3(1, 0, 0).applyQuaternion(camera.quaternion);
    const p = s
      .tip()
      .addScaledVector(s.view(), 0.01 * Math.cos(half))
      .addScaledVector(right, 0.01 * Math.sin(half))
      .project(camera);
    expect(Math.abs(p.x) * Math.max(1, aspect)).toBeCloseTo(kRound, 5);
    expect(p.y).toBeCloseTo(0, 6);
  });
});

describe('light at the tip', () => {
  it('falls with the square of the way within a tenth of a metre, by a line of three.js that is there to be changed', () => {
    expect(ShaderChunk.lights_pars_begin).toContain('0.01 )');
    expect(installNearLight()).toBe(true);
    expect(ShaderChunk.lights_pars_begin).toContain('max( pow( lightDistance, decayExponent ), 1e-8 )');
    expect(ShaderChunk.lights_pars_begin).not.toContain('decayExponent ), 0.01');
    expect(installNearLight()).toBe(true);
  });
});
