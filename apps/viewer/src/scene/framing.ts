// From where things are seen whole in the part of the window that nothing lies over.
import { MathUtils, Vector3, type Sphere } from 'three';
import type { View } from './flight';

/** Of the window's sides, pixels that something lies over. */
export interface Insets {
  left: number;
  top: number;
  right: number;
  bottom: number;
}
export const kNothingOver: Insets = { left: 0, top: 0, right: 0, bottom: 0 };

// Pixels around what is seen: a finger begins beside the rim, and hits what is within 22 of it (kFingerPixels).
const kAround = 28;
// Of a side of the window: what is left free is not taken to be less, however much lies over it.
const kLeastFree = 0.3;

/** What is to be seen: all of the places. */
export interface Subject {
  places: Vector3[];
  /** Seen too, where the eye need not go far away for it. */
  beside: Vector3[];
  /** Round the bodies. */
  ball: Sphere;
}
export interface Window {
  width: number;
  height: number;
  /** Degrees, from top to bottom. */
  field: number;
  over: Insets;
}

/** The free part along one axis, from -1 to 1. */
function freePart(size: number, before: number, after: number): [number, number] {
  const half = Math.max(kLeastFree, 1 - (before + after + 2 * kAround) / size),
    middle = MathUtils.clamp((before - after) / size, half - 1, 1 - half);
  return [middle - half, middle + half];
}

/** Limits of the eye's place along one axis, from where all is seen within a part of the picture. */
interface Limits {
  /** metres: from nearer it is not seen whole */
  nearest: number;
  at(distance: number): [number, number];
}
/** `across`: of places along the axis, `ahead`: along the view; `slope`: of the picture's edge. */
function limits(across: number[], ahead: number[], slope: number, [low, high]: readonly [number, number]): Limits {
  let most = -Infinity,
    least = Infinity;
  across.forEach((x, i) => {
    most = Math.max(most, x - high * slope * ahead[i]!);
    least = Math.min(least, x - low * slope * ahead[i]!);
  });
  return {
    nearest: (most - least) / ((high - low) * slope),
    at: (d) => [most - high * slope * d, least - low * slope * d],
  };
}
const middleOf = ([a, b]: [number, number]): number => (a + b) / 2;

/**
 * Looks at places from a direction (a unit vector towards the eye), from no nearer than `least` metres. From top to bottom they are about in the
 * middle of the free part, from left to right of the window where that is free.
 */
export function frameView(places: readonly Vector3[], towards: Vector3, least: number, w: Window): View {
  const ahead = towards.clone().negate(),
    right = new Vector3(ahead.y || 1e-9, -ahead.x, 0).normalize(),
    above = right.clone().cross(ahead);
  const along = (axis: Vector3): number[] => places.map((p) => p.dot(axis));
  const [x, y, z] = [along(right), along(above), along(ahead)];
  // The target lies in the middle of them along the view.
  const depth = (z.reduce((a, b) => Math.min(a, b)) + z.reduce((a, b) => Math.max(a, b))) / 2,
    behind = z.map((t) => t - depth);
  const slope = Math.tan(MathUtils.degToRad(w.field) / 2),
    aspect = w.width / w.height;
  const sides = limits(x, behind, slope * aspect, freePart(w.width, w.over.left, w.over.right)),
    whole = limits(x, behind, slope * aspect, [-1, 1]),
    heights = limits(y, behind, slope, freePart(w.height, w.over.bottom, w.over.top));
  const d = Math.max(least, sides.nearest, heights.nearest),
    [from, to] = sides.at(d);
  const target = right
    .multiplyScalar(MathUtils.clamp(middleOf(whole.at(d)), from, to))
    .addScaledVector(above, middleOf(heights.at(d)))
    .addScaledVector(ahead, depth);
  return { position: target.clone().addScaledVector(towards, d), target };
}

// Times as far away for what lies beside. On a phone held upright the tray takes 1.34; held on its side 2.0, and the steak would be a stamp.
const kFartherForBeside = 1.4;

/** As frameView, for a subject. */
export function frameSubject({ places, beside }: Subject, towards: Vector3, least: number, w: Window): View {
  const alone = frameView(places, towards, least, w);
  if (beside.length === 0) return alone;
  const all = frameView(places.concat(beside), towards, least, w),
    away = (v: View): number => v.position.distanceTo(v.target);
  return away(all) <= kFartherForBeside * away(alone) ? all : alone;
}

/** Whether nothing lies over a place of the window, pixels. */
export function isFree([x, y]: readonly [number, number], width: number, height: number, over: Insets): boolean {
  return x >= over.left && x <= width - over.right && y >= over.top && y <= height - over.bottom;
}
