// Which pointer does what: tool, orbit or nothing. Pure, so that it can be tested without a browser.

export type PointerKind = 'mouse' | 'pen' | 'touch';
export interface PointerDown {
  id: number;
  kind: PointerKind;
  button: number;
  alt: boolean;
}
export type Decision = 'tool' | 'orbit' | 'cancel-and-orbit';

/**
 * Decides for each pointer that goes down. Left button, pen or one finger use the tool; other buttons, Alt, a second finger
 * and the hand tool move the camera. Once a pen was seen, fingers only move the camera: a resting hand must not cut.
 */
export class PointerMap {
  handTool = false;
  /** False while tool input is paused (connection lost, or another page holds the tools). */
  toolAllowed = true;
  private penSeen = false;
  private toolPointer: number | null = null;
  private readonly touches = new Set<number>();

  get active(): number | null {
    return this.toolPointer;
  }

  down(p: PointerDown): Decision {
    if (p.kind === 'pen') this.penSeen = true;
    if (p.kind === 'touch') this.touches.add(p.id);
    if (this.toolPointer !== null) {
      if (p.kind === 'touch') {
        this.toolPointer = null;
        return 'cancel-and-orbit';
      }
      return 'orbit';
    }
    const orbit =
      this.handTool ||
      !this.toolAllowed ||
      p.alt ||
      p.button !== 0 ||
      (p.kind === 'touch' && (this.penSeen || this.touches.size > 1));
    if (orbit) return 'orbit';
    this.toolPointer = p.id;
    return 'tool';
  }

  /** True when this pointer is the tool's. */
  owns(id: number): boolean {
    return this.toolPointer === id;
  }

  up(id: number): boolean {
    this.touches.delete(id);
    if (this.toolPointer !== id) return false;
    this.toolPointer = null;
    return true;
  }

  /** Forgets the stroke (lost connection, blur); true when there was one. */
  cancel(): boolean {
    const was = this.toolPointer !== null;
    this.toolPointer = null;
    return was;
  }
}

/** Two fingers: how far each move of one brings them apart, and their middle on. */
export class TwoFingers {
  private readonly at = new Map<number, { x: number; y: number }>();

  down(id: number, x: number, y: number): void {
    this.at.set(id, { x, y });
  }
  up(id: number): void {
    this.at.delete(id);
  }
  /** Pixels; null unless there are two. */
  move(id: number, x: number, y: number): { apart: number; x: number; y: number } | null {
    const was = this.at.get(id);
    if (!was) return null;
    this.at.set(id, { x, y });
    if (this.at.size !== 2) return null;
    const other = [...this.at].find(([i]) => i !== id)![1];
    const away = (p: { x: number; y: number }): number => Math.hypot(p.x - other.x, p.y - other.y);
    return { apart: away({ x, y }) - away(was), x: (x - was.x) / 2, y: (y - was.y) / 2 };
  }
}
