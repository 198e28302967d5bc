// What the plots show: how steps, cuts and contacts of the scene that is shown went.
import { Outcome, type Counts, type CutReport, type Stats } from '../engine/protocol';
import type { ThingsView } from '../scene/things';
import { Series } from './series';

export class Records {
  readonly steps = new Series(5); // seconds of the page's clock, step median, step 99 %, mechanics, fps
  readonly cutTimes = new Series(5); // number, binding, embedding, surface, total
  readonly contacts = new Series(4); // seconds of the page's clock, contacts, N pressed with, N on the tools
  readonly counts = new Series(7); // cut number, six counts
  cuts = 0;

  stats(stats: Stats, fps: number, things: ThingsView): void {
    const now = performance.now() / 1000;
    this.steps.push(now, stats.stepMs, stats.stepMs99, stats.mechanicsMs, fps);
    const felt = Math.max(0, ...things.tools.map((t) => Math.hypot(...t.force)));
    this.contacts.push(now, things.touching, things.press, felt);
    if (this.counts.length === 0) this.count(stats.counts);
  }
  cut(report: CutReport): void {
    if (report.outcome !== Outcome.Cut) return;
    this.cuts++;
    if (report.trianglesCut > 0)
      this.cutTimes.push(this.cuts, report.bindingMs, report.embeddingMs, report.surfaceMs, report.totalMs);
    this.count(report.counts);
  }
  clear(): void {
    this.cuts = 0;
    for (const s of [this.steps, this.contacts, this.cutTimes, this.counts]) s.clear();
  }

  private count(c: Counts): void {
    this.counts.push(
      this.cuts,
      c.visualVertices,
      c.visualTriangles,
      c.collisionVertices,
      c.collisionTriangles,
      c.nodes,
      c.hexahedra,
    );
  }
}
