import { describe, expect, it } from 'vitest';
import { LatencyMeter, quantile } from '../src/stats/latency';
import { QualityChooser, kQualitySteps } from '../src/stats/quality';
import { Series } from '../src/stats/series';

describe('latency', () => {
  it('measures from the event to the echo and to the picture', () => {
    const m = new LatencyMeter();
    m.sent(1, 100, 'cut');
    m.sent(2, 110, 'cut');
    m.sent(3, 120, 'cut');
    m.echoed(2, 130, 'cut'); // answers 1 and 2; 1 has changed nothing
    expect(m.last).toEqual({ applied: 20, presented: null });
    m.shown(145);
    expect(m.last).toEqual({ applied: 20, presented: 35 });
    m.echoed(1, 150, 'cut'); // already answered
    m.echoed(3, 160, 'cut');
    m.shown(161);
    m.shown(300);
    const s = m.summary();
    expect(s.count).toBe(2);
    expect(s.applied99).toBe(40);
    expect(s.presented99).toBe(41);
  });
  it('counts cuts by patches and motions by frames, each motion that a frame shows', () => {
    const m = new LatencyMeter();
    m.sent(1, 0, 'cut');
    m.echoed(1, 5, 'motion'); // a scalpel in the air
    m.sent(2, 10, 'motion');
    m.sent(3, 20, 'motion');
    m.echoed(3, 30, 'motion');
    expect(m.summary('cut').count).toBe(0);
    const s = m.summary('motion');
    expect([s.count, s.appliedMedian, s.applied99]).toEqual([2, 20, 20]);
  });
  it('forgets on request and does not grow', () => {
    const m = new LatencyMeter();
    for (let i = 0; i < 10000; i++) m.sent(i, i, 'cut');
    m.forget();
    m.echoed(9999, 20000, 'cut');
    expect(m.summary().count).toBe(0);
  });
  it('has quantiles', () => {
    expect(quantile([], 0.5)).toBeNaN();
    expect(quantile([3, 1, 2], 0.5)).toBe(2);
    expect(quantile([3, 1, 2], 0.99)).toBe(3);
  });
});

/** Feeds intervals until the step changes or `n` frames have passed. */
function feed(c: QualityChooser, ms: number, n: number): boolean {
  for (let i = 0; i < n; i++) if (c.frame(ms)) return true;
  return false;
}

describe('quality', () => {
  it('stays at full when frames come in time', () => {
    const c = new QualityChooser(0);
    expect(feed(c, 16.7, 5000)).toBe(false);
    expect(c.current.level).toBe('full');
  });
  it('goes down until it is fast enough, and ends at the cheapest', () => {
    const c = new QualityChooser(0);
    for (let i = 0; i < 50; i++) feed(c, 90, 200);
    expect(c.step).toBe(kQualitySteps.length - 1);
  });
  it('does not oscillate between a step that is too slow and one that is not', () => {
    const c = new QualityChooser(0);
    let changes = 0;
    for (let i = 0; i < 20000; i++) if (c.frame(c.step < 3 ? 40 : 16.7)) changes++;
    expect(c.step).toBe(3);
    expect(changes).toBeLessThanOrEqual(3);
  });
  it('tries better steps after a slow start', () => {
    const c = new QualityChooser(4);
    for (let i = 0; i < 5000; i++) c.frame(16.7);
    expect(c.step).toBe(0);
  });
  it('forgets single hitches and hidden pages', () => {
    const c = new QualityChooser(0);
    for (let i = 0; i < 2000; i++) expect(c.frame(i % 50 === 0 ? 400 : i % 97 === 0 ? 60000 : 16.7)).toBe(false);
  });
});

it('series keeps the last rows, as columns', () => {
  const s = new Series(2, 3);
  for (let i = 0; i < 5; i++) s.push(i, 10 * i);
  expect(s.data()).toEqual([
    [2, 3, 4],
    [20, 30, 40],
  ]);
});
