// When the samples of a stroke are sent. Pointers are read as fast as they come (a mouse gives up to a thousand a second);
// what is sent must not outrun the engine, or cuts queue up behind each other.

const kLeastGapMs = 4; // between messages
const kBehindMs = 30; // an input unanswered for this long: the engine is busy, samples wait for it
const kPatienceMs = 250; // and for this long: the answer got lost

export class Pacer {
  private lastSent = -Infinity;
  private readonly unanswered: { input: number; at: number }[] = [];

  /** Whether a message may go now (milliseconds on one clock). */
  ready(now: number): boolean {
    while (this.unanswered.length > 0 && now - this.unanswered[0]!.at > kPatienceMs) this.unanswered.shift();
    const oldest = this.unanswered[0];
    return now - this.lastSent >= kLeastGapMs && (oldest === undefined || now - oldest.at < kBehindMs);
  }
  sent(input: number, now: number): void {
    this.lastSent = now;
    this.unanswered.push({ input, at: now });
  }
  /** A message echoed this input: it answers all before it too. */
  answered(input: number): void {
    while (this.unanswered.length > 0 && this.unanswered[0]!.input <= input) this.unanswered.shift();
  }
  forget(): void {
    this.unanswered.length = 0;
  }
}

/**
 * Which samples of an event are new. A browser that has raw events tells every sample twice: raw, and with the move of its picture; either may
 * come first. Time stamps are rounded, so samples that follow each other may have the same.
 */
export class FreshSamples {
  /** How often each sample came raw and with a move. */
  private readonly came = new Map<string, [number, number]>();

  /** A stroke begins. */
  begin(): void {
    this.came.clear();
  }
  of<Sample extends { timeStamp: number; clientX: number; clientY: number }>(
    samples: Sample[],
    raw: boolean,
  ): Sample[] {
    return samples.filter((s) => {
      const key = `${s.timeStamp} ${s.clientX} ${s.clientY}`,
        times = this.came.get(key) ?? [0, 0],
        known = Math.max(...times);
      this.came.set(key, times);
      return ++times[raw ? 0 : 1] > known;
    });
  }
}
