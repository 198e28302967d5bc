// How far something that comes and goes is there: 0 to 1, at an even pace.

const kComes = 90, // ms from nothing to all of it
  kGoes = 180;

export class Presence {
  level = 0;
  private wanted = 0;
  private last = 0;

  /** It is wanted there; `atOnce`: without a fade. */
  come(atOnce: boolean): void {
    this.wanted = 1;
    if (atOnce) this.level = 1;
  }
  /** True when there is something to fade. */
  go(): boolean {
    this.wanted = 0;
    return this.level > 0;
  }
  end(): void {
    this.level = this.wanted = 0;
  }
  get going(): boolean {
    return this.wanted === 0 && this.level > 0;
  }
  /** Brings the level to a time in ms; true when it changed. A pause in between counts as one picture. */
  at(now: number): boolean {
    const passed = Math.min(40, Math.max(0, now - this.last));
    this.last = now;
    if (this.level === this.wanted) return false;
    this.level =
      this.wanted > this.level ? Math.min(1, this.level + passed / kComes) : Math.max(0, this.level - passed / kGoes);
    return true;
  }
}
