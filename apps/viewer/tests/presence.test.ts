import { describe, expect, it } from 'vitest';
import { Presence } from '../src/scene/presence';

/** Pictures until nothing changes any more. */
const pictures = (p: Presence, from: number, every: number): number => {
  let n = 0;
  for (let now = from; p.at(now); now += every) n++;
  return n;
};

describe('presence', () => {
  it('comes and goes over several pictures, and then rests', () => {
    const p = new Presence();
    p.at(0);
    p.come(false);
    expect(pictures(p, 16, 16)).toBeGreaterThan(3);
    expect(p.level).toBe(1);
    expect(p.go()).toBe(true);
    expect(p.going).toBe(true);
    expect(pictures(p, 1000, 16)).toBeGreaterThan(6);
    expect(p.level).toBe(0);
    expect(p.going).toBe(false);
    expect(p.go()).toBe(false);
  });
  it('turns round half-way, and does not jump after a pause', () => {
    const p = new Presence();
    p.come(true);
    expect(p.level).toBe(1);
    p.at(0);
    p.go();
    p.at(5000);
    expect(p.level).toBeGreaterThan(0.5);
    p.come(false);
    p.at(5016);
    p.at(5050);
    expect(p.level).toBe(1);
  });
});
