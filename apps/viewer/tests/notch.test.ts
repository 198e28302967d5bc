import { describe, expect, it } from 'vitest';
import { markReach } from '../src/ui/notch';

describe('the mark of the arthroscope', () => {
  const bar = { left: 400, top: 660, right: 880, bottom: 710 },
    reach = (way: [number, number], cards = [bar]): number => markReach([640, 360], way, 340, cards);
  it('lies at the rim where that is free', () => {
    expect(reach([0, 1], [])).toBe(340);
    expect(reach([0, -1])).toBe(340);
    expect(reach([1, 0])).toBe(340);
  });
  it('makes way for cards, as far as it must', () => {
    expect(360 + reach([0, 1])).toBeLessThan(bar.top - 7);
    expect(360 + reach([0, 1])).toBeGreaterThan(bar.top - 7 - 10);
    const above = { ...bar, top: 600, bottom: 650 };
    expect(360 + reach([0, 1], [bar, above])).toBeLessThan(above.top - 7);
  });
  it('stays at the rim where cards leave no place', () => {
    expect(reach([0, 1], [{ left: 0, top: 0, right: 1280, bottom: 720 }])).toBe(340);
  });
});
