// From pointer event to the change in the page, and on to the picture.

export interface LatencyRecord { applied: number; presented: number | null }
export interface LatencySummary { count: number; appliedMedian: number; applied99: number; presentedMedian: number; presented99: number }

const kKept = 300;
const kForgotten = 2048;

export function quantile(values: number[], q: number): number {
  if (values.length === 0) return NaN;
  const s = values.slice().sort((a, b) => a - b);
  return s[Math.min(s.length - 1, Math.floor(q * s.length))]!;
}

/** Remembers when each input happened, until a message echoes its number. */
export class LatencyMeter {
  private readonly pending = new Map<number, number>();
  private applied: number[] = [];
  private presented: number[] = [];
  private waiting: number[] = []; // start times of what was applied and is not presented yet
  last: LatencyRecord | null = null;

  /** An input was sent; `started` is its event's time stamp on the clock of performance.now(). */
  sent(input: number, started: number): void {
    this.pending.set(input, started);
    if (this.pending.size > kForgotten) this.pending.delete(this.pending.keys().next().value!);
  }

  /** A message that echoes `input` was applied: it answers that input and all before it. */
  echoed(input: number, now: number): void {
    const started = this.pending.get(input);
    for (const key of this.pending.keys()) if (key <= input) this.pending.delete(key);
    if (started === undefined) return;
    this.last = { applied: now - started, presented: null };
    this.applied.push(now - started);
    if (this.applied.length > kKept) this.applied.shift();
    this.waiting.push(started);
  }

  /** The picture that shows everything applied so far is on its way to the screen. */
  shown(now: number): void {
    if (this.waiting.length === 0) return;
    for (const started of this.waiting) {
      this.presented.push(now - started);
      if (this.presented.length > kKept) this.presented.shift();
    }
    if (this.last) this.last.presented = now - this.waiting[this.waiting.length - 1]!;
    this.waiting = [];
  }
  get hasWaiting(): boolean { return this.waiting.length > 0; }

  reset(): void { this.forget(); this.applied = []; this.presented = []; this.last = null; }
  /** Inputs under way will not be answered. */
  forget(): void { this.pending.clear(); this.waiting = []; }

  summary(): LatencySummary {
    return {
      count: this.applied.length, appliedMedian: quantile(this.applied, 0.5), applied99: quantile(this.applied, 0.99),
      presentedMedian: quantile(this.presented, 0.5), presented99: quantile(this.presented, 0.99),
    };
  }
}
