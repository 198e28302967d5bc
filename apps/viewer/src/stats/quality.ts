// Chooses how much to spend on a picture from how long pictures take.
import { quantile } from './latency';
import type { QualityLevel } from '../scene/materials';

export interface QualityStep {
  level: QualityLevel;
  scale: number;
}

/** From best to cheapest; `scale` multiplies the screen's pixel ratio. */
export const kQualitySteps: QualityStep[] = [
  { level: 'full', scale: 1 },
  { level: 'low', scale: 1 },
  { level: 'low', scale: 0.75 },
  { level: 'lite', scale: 1 },
  { level: 'lite', scale: 0.75 },
  { level: 'lite', scale: 0.6 },
  { level: 'lite', scale: 0.5 },
];

const kTooSlowMs = 25; // a 60 Hz screen misses every other frame
const kMuchTooSlowMs = 60;
const kFastMs = 18;
const kFirstFrames = 20; // to judge a step by
const kPatienceMs = 6000; // of smooth frames before a better step is tried

export class QualityChooser {
  step: number;
  private intervals: number[] = [];
  private elapsed = 0;
  /** Steps better than this were tried and were too slow. */
  private best: number;
  private warmup = 0;

  constructor(start: number, best = 0) {
    this.step = start;
    this.best = best;
  }

  get current(): QualityStep {
    return kQualitySteps[this.step]!;
  }

  /** Time from a drawn frame to the next one, in milliseconds. Returns true when the step changed. */
  frame(ms: number): boolean {
    if (this.warmup > 0) {
      this.warmup--;
      return false;
    } // frames that compile programs say nothing
    if (ms > 500) return false; // the page was hidden
    this.intervals.push(ms);
    this.elapsed += ms;
    const median = quantile(this.intervals, 0.5);
    const enough = this.intervals.length >= kFirstFrames || this.elapsed > 1500;
    if (enough && median > kTooSlowMs && this.step < kQualitySteps.length - 1) {
      this.best = Math.max(this.best, this.step + 1);
      return this.change(this.step + (median > kMuchTooSlowMs ? 2 : 1));
    }
    if (this.elapsed > kPatienceMs) {
      if (median < kFastMs && this.step > this.best) return this.change(this.step - 1);
      this.intervals = [];
      this.elapsed = 0;
    }
    return false;
  }

  private change(to: number): boolean {
    this.step = Math.min(to, kQualitySteps.length - 1);
    this.intervals = [];
    this.elapsed = 0;
    this.warmup = 6;
    return true;
  }
}
