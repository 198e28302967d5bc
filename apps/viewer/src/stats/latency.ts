// From pointer event to the change in the page, and on to the picture.

export interface LatencyRecord {
  applied: number;
  presented: number | null;
}
export interface LatencySummary {
  count: number;
  appliedMedian: number;
  applied99: number;
  presentedMedian: number;
  presented99: number;
}
/** What an input asks for: a change of topology, which a patch answers, or a motion, which a frame answers. */
export type Wanted = 'cut' | 'motion';

const kKept = 1000;
const kForgotten = 2048;

export function quantile(values: number[], q: number): number {
  if (values.length === 0) return NaN;
  const s = values.slice().sort((a, b) => a - b);
  return s[Math.min(s.length - 1, Math.floor(q * s.length))]!;
}

class Times {
  applied: number[] = [];
  presented: number[] = [];
  push(list: number[], ms: number): void {
    list.push(ms);
    if (list.length > kKept) list.shift();
  }
  summary(): LatencySummary {
    return {
      count: this.applied.length,
      appliedMedian: quantile(this.applied, 0.5),
      applied99: quantile(this.applied, 0.99),
      presentedMedian: quantile(this.presented, 0.5),
      presented99: quantile(this.presented, 0.99),
    };
  }
}

/**
 * Remembers when each input happened, until a message echoes its number. Inputs that change nothing (a scalpel in the air)
 * measure nothing.
 */
export class LatencyMeter {
  private readonly pending = new Map<number, { started: number; wanted: Wanted }>();
  private times: Record<Wanted, Times> = { cut: new Times(), motion: new Times() };
  private waiting: { started: number; wanted: Wanted }[] = []; // applied and not presented yet
  last: LatencyRecord | null = null;

  /** An input was sent; `started` is its event's time stamp on the clock of performance.now(). */
  sent(input: number, started: number, wanted: Wanted): void {
    this.pending.set(input, { started, wanted });
    if (this.pending.size > kForgotten) this.pending.delete(this.pending.keys().next().value!);
  }

  /**
   * A message that echoes `input` was applied: a patch ('cut'), which answers that input, or a frame ('motion'), which
   * shows all motions up to it. All inputs up to it are done with.
   */
  echoed(input: number, now: number, by: Wanted): void {
    const times = this.times[by];
    for (const [key, { started, wanted }] of this.pending) {
      if (key > input) continue;
      this.pending.delete(key);
      if (wanted !== by || (by === 'cut' && key !== input)) continue;
      this.last = { applied: now - started, presented: null };
      times.push(times.applied, now - started);
      this.waiting.push({ started, wanted });
    }
  }

  /** The picture that shows everything applied so far is on its way to the screen. */
  shown(now: number): void {
    if (this.waiting.length === 0) return;
    for (const { started, wanted } of this.waiting)
      this.times[wanted].push(this.times[wanted].presented, now - started);
    if (this.last) this.last.presented = now - this.waiting[this.waiting.length - 1]!.started;
    this.waiting = [];
  }
  get hasWaiting(): boolean {
    return this.waiting.length > 0;
  }

  reset(): void {
    this.forget();
    this.times = { cut: new Times(), motion: new Times() };
    this.last = null;
  }
  /** Inputs under way will not be answered. */
  forget(): void {
    this.pending.clear();
    this.waiting = [];
  }

  summary(of: Wanted = 'cut'): LatencySummary {
    return this.times[of].summary();
  }
}
