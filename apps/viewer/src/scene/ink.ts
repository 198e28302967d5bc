// Strokes as they are drawn on the screen: what the scalpel has still to cut, rubber band, closed outline.
import type { ToolName } from '../tools/tools';

const kDrawn: ReadonlySet<ToolName> = new Set(['scalpel', 'line', 'closed', 'scissors'] as const);

const kAround = 28; // pixels about places: lines are 4 wide, names of ends stand 22 beside them
const kTile = 64; // pixels that the sheet grows by: less makes it anew with every place, more covers more of the picture

interface Point {
  x: number;
  y: number;
  /** The message that its sample went with; 0: it has not gone yet. */
  input: number;
}
interface Line {
  tool: ToolName;
  points: Point[];
  ended: boolean;
}

/** What was drawn and is not cut yet, of the stroke under the pointer and of those that the engine has still to cut. */
export class Ink {
  private lines: Line[] = [];
  private drawn = false;
  private pixelRatio = 1;
  /** Of the window that the sheet covers: pixels of the page. */
  private readonly frame = { x: 0, y: 0, width: 0, height: 0 };
  constructor(private readonly canvas: HTMLCanvasElement) {
    canvas.hidden = true;
  }

  resize(ratio: number): void {
    this.pixelRatio = ratio;
    this.frame.width = this.frame.height = 0;
  }
  private get current(): Line | undefined {
    const last = this.lines[this.lines.length - 1];
    return last && !last.ended ? last : undefined;
  }
  begin(tool: ToolName, x: number, y: number): void {
    this.drop();
    if (kDrawn.has(tool)) this.lines.push({ tool, points: [{ x, y, input: 0 }], ended: false });
  }
  add(x: number, y: number): void {
    this.current?.points.push({ x, y, input: 0 });
  }
  /** All that was drawn so far has gone to the engine with this message, the last of several. */
  sent(input: number): void {
    const line = this.current;
    for (const p of line?.points ?? []) if (p.input === 0 || line!.tool !== 'scalpel') p.input = input;
  }
  /** The stroke is up; what the engine has not cut stays. */
  end(): void {
    const line = this.current;
    if (!line) return;
    line.ended = true;
    if (line.points.some((p) => p.input === 0)) this.lines.pop();
  }
  /** The stroke under the pointer is taken back. */
  drop(): void {
    if (this.current) this.lines.pop();
  }
  clear(): void {
    this.lines = [];
  }
  /** The engine has done all up to this message. */
  done(input: number): void {
    for (const line of this.lines) {
      const open = line.points.findIndex((p) => p.input === 0 || p.input > input);
      if (open < 0 && line.ended) line.points = [];
      // The last place that is cut is where the rest begins. Scissors cut once they have gone their blades' length: their trail stays.
      else if (line.tool === 'scalpel') line.points.splice(0, (open < 0 ? line.points.length : open) - 1);
    }
    this.lines = this.lines.filter((line) => line.points.length > 0);
  }
  /** Places that are drawn, of all strokes. */
  get waiting(): number {
    return this.lines.reduce((n, line) => n + line.points.length, 0);
  }

  draw(): void {
    if (!this.drawn && this.lines.length === 0) return;
    this.drawn = this.lines.length > 0;
    this.canvas.hidden = !this.drawn;
    const c = this.canvas.getContext('2d');
    if (!c) return;
    if (this.drawn) this.cover();
    const { x, y, width, height } = this.frame;
    c.setTransform(this.pixelRatio, 0, 0, this.pixelRatio, -x * this.pixelRatio, -y * this.pixelRatio);
    c.clearRect(x, y, width, height);
    for (const line of this.lines) this.drawLine(c, line);
  }

  /** Lays the sheet over what is drawn: one over the whole picture takes as long as a third of the picture, though it is empty. */
  private cover(): void {
    const places = this.lines.flatMap((line) => line.points);
    const span = (of: (p: Point) => number): [number, number] => {
      let lo = Infinity,
        hi = -Infinity;
      for (const p of places) {
        lo = Math.min(lo, of(p));
        hi = Math.max(hi, of(p));
      }
      return [Math.floor((lo - kAround) / kTile) * kTile, Math.ceil((hi + kAround) / kTile) * kTile];
    };
    const [left, right] = span((p) => p.x),
      [top, bottom] = span((p) => p.y);
    const f = this.frame,
      width = right - left,
      height = bottom - top;
    if (f.x === left && f.y === top && f.width === width && f.height === height) return;
    Object.assign(f, { x: left, y: top, width, height });
    Object.assign(this.canvas.style, {
      left: `${left}px`,
      top: `${top}px`,
      width: `${width}px`,
      height: `${height}px`,
    });
    this.canvas.width = Math.round(width * this.pixelRatio);
    this.canvas.height = Math.round(height * this.pixelRatio);
  }

  private drawLine(c: CanvasRenderingContext2D, line: Line): void {
    const p = line.points.map(({ x, y }): [number, number] => [x, y]),
      a = p[0],
      b = p[p.length - 1];
    if (!a || !b) return;
    c.lineCap = c.lineJoin = 'round';
    const stroke = (points: [number, number][], dash: number[]): void => {
      for (const [width, colour] of [
        [4, 'rgb(0 0 0 / .45)'],
        [1.8, '#fff'],
      ] as const) {
        c.setLineDash(dash);
        c.lineWidth = width;
        c.strokeStyle = colour;
        c.beginPath();
        points.forEach(([x, y], i) => {
          if (i === 0) c.moveTo(x, y);
          else c.lineTo(x, y);
        });
        c.stroke();
      }
    };
    if (line.tool === 'line') {
      stroke([a, b], [7, 6]);
      c.setLineDash([]);
      for (const [[x, y], name] of [
        [a, 'A'],
        [b, 'B'],
      ] as [[number, number], string][]) {
        c.fillStyle = '#fff';
        c.strokeStyle = 'rgb(0 0 0 / .6)';
        c.lineWidth = 1.5;
        c.beginPath();
        c.arc(x, y, 4.5, 0, 7);
        c.fill();
        c.stroke();
        c.font = '600 13px system-ui, sans-serif';
        c.lineWidth = 3;
        c.strokeText(name, x + 9, y - 8);
        c.fillText(name, x + 9, y - 8);
      }
    } else if (line.tool === 'closed') {
      stroke(p, []);
      stroke([b, a], [4, 6]);
    } else {
      stroke(line.tool === 'scissors' ? p.slice(-14) : p, []);
    }
  }
}
