// Values over time for the plots.

/** The last `capacity` rows of several columns. */
export class Series {
  private rows: (number | null)[][] = [];
  constructor(
    readonly columns: number,
    readonly capacity = 600,
  ) {}
  get length(): number {
    return this.rows.length;
  }
  push(...row: (number | null)[]): void {
    this.rows.push(row);
    if (this.rows.length > this.capacity) this.rows.shift();
  }
  clear(): void {
    this.rows = [];
  }
  /** One array per column. */
  data(): (number | null)[][] {
    return Array.from({ length: this.columns }, (_, c) => this.rows.map((r) => r[c] ?? null));
  }
}
