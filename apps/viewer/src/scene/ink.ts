// The stroke as it is drawn on the screen: trail of the scalpel, rubber band, closed outline.
import type { ToolName } from '../tools/tools';

const kDrawn: ReadonlySet<ToolName> = new Set(['scalpel', 'line', 'closed', 'scissors'] as const);

export class Ink {
  private points: [number, number][] = [];
  private tool: ToolName = 'scalpel';
  private drawn = false;
  constructor(private readonly canvas: HTMLCanvasElement) {}

  resize(width: number, height: number, ratio: number): void {
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.canvas.getContext('2d')?.setTransform(ratio, 0, 0, ratio, 0, 0);
  }
  begin(tool: ToolName, x: number, y: number): void {
    this.tool = tool;
    this.points = [[x, y]];
  }
  add(x: number, y: number): void {
    this.points.push([x, y]);
  }
  end(): void {
    this.points = [];
  }

  draw(): void {
    const c = this.canvas.getContext('2d');
    if (!c || (!this.drawn && this.points.length === 0)) return;
    c.save();
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.clearRect(0, 0, this.canvas.width, this.canvas.height);
    c.restore();
    this.drawn = this.points.length > 0;
    const p = this.points,
      a = p[0],
      b = p[p.length - 1];
    if (!a || !b || !kDrawn.has(this.tool)) return;
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
    if (this.tool === 'line') {
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
    } else if (this.tool === 'closed') {
      stroke(p, []);
      stroke([b, a], [4, 6]);
    } else {
      stroke(p.slice(-14), []);
    }
  }
}
