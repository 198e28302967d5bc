// What Hello says of the scene that is shown, and of the others.
import type { Hello, Vec3 } from './engine/protocol';
import { type Look, toLook } from './scene/materials';
import type { Box } from './scene/stage';
import { kTools, type ToolName } from './tools/tools';

export interface SceneInfo {
  /** `goal`: what to try there, or empty. */
  scenes: { name: string; title: string; goal: string }[];
  name: string;
  title: string;
  look: Look;
  box: Box | null;
  material: { young: number; poisson: number; density: number };
  gravity: [number, number, number];
  /** Of meshes that were opened in the page. */
  unit: { metres: number; guessed: boolean } | null;
  /** By the page, from files: its name may be that of a shipped scene too. */
  opened: boolean;
  /** What should be taken out. */
  lesion: Lesion | null;
  /** What the scene's own commands do, and whether they run now. */
  script: SceneScript | null;
  /** Of the arthroscope, where the scene says. */
  scope: { entry: Vec3; target: Vec3; angle: number } | null;
}

export interface SceneScript {
  /** s */
  ends: number;
  runs: boolean;
  /** From the body to an eye that sees well what they do. */
  view: Vec3 | null;
  /** Tool, and seven numbers a place: time, point, axis towards the hand. */
  hands: { tool: ToolName; places: number[][] }[];
}

export interface Lesion {
  shape: 'sphere' | 'box' | 'half_space';
  values: number[];
}

const num = (x: unknown, fallback: number): number => (typeof x === 'number' && Number.isFinite(x) ? x : fallback);

/** Reads Hello's JSON; whatever is missing or odd gets a default. */
export function readSceneInfo(hello: Pick<Hello, 'name' | 'json'>): SceneInfo {
  let j: Record<string, unknown> = {};
  try {
    const parsed: unknown = JSON.parse(hello.json);
    if (parsed && typeof parsed === 'object') j = parsed as Record<string, unknown>;
  } catch {
    /* an engine without a description still works */
  }
  const scenes = (Array.isArray(j.scenes) ? j.scenes : []).flatMap((s: unknown) => {
    const o = s as { name?: unknown; title?: unknown; goal?: unknown } | null;
    const words = (x: unknown, otherwise: string): string => (typeof x === 'string' ? x : otherwise);
    return o && typeof o.name === 'string'
      ? [{ name: o.name, title: words(o.title, o.name), goal: words(o.goal, '') }]
      : [];
  });
  const m = (j.material ?? {}) as Record<string, unknown>,
    g = Array.isArray(j.gravity) ? j.gravity : [];
  const u = (j.unit ?? {}) as Record<string, unknown>;
  const b =
    Array.isArray(j.box) && j.box.length === 6 && j.box.every((x) => Number.isFinite(x)) ? (j.box as number[]) : null;
  const proper = b && b[0]! <= b[3]! && b[1]! <= b[4]! && b[2]! <= b[5]! && b.some((x) => x !== b[0]);
  return {
    scenes,
    name: hello.name,
    title: typeof j.title === 'string' ? j.title : hello.name,
    look: toLook(j.look),
    box: b && proper ? { min: [b[0]!, b[1]!, b[2]!], max: [b[3]!, b[4]!, b[5]!] } : null,
    material: { young: num(m.young, 20000), poisson: num(m.poisson, 0.45), density: num(m.density, 1000) },
    gravity: [num(g[0], 0), num(g[1], 0), num(g[2], -9.81)],
    opened: j.opened === true,
    lesion: readLesion(j.lesion),
    scope: readScope(j.arthroscope),
    script: readScript(j.script),
    unit: num(u.metres, 0) > 0 ? { metres: num(u.metres, 1), guessed: u.guessed === true } : null,
  };
}

function readScript(from: unknown): SceneScript | null {
  if (!from || typeof from !== 'object') return null;
  const o = from as { ends?: unknown; runs?: unknown; view?: unknown; hands?: unknown };
  const ends = num(o.ends, 0);
  if (!(ends > 0)) return null;
  const hands = (Array.isArray(o.hands) ? o.hands : []).flatMap((h: unknown) => {
    const { tool, places } = (h ?? {}) as { tool?: unknown; places?: unknown };
    const known = kTools.find((t) => t.name === tool);
    const good = (Array.isArray(places) ? places : []).filter(
      (p): p is number[] => Array.isArray(p) && p.length === 7 && p.every((x) => Number.isFinite(x)),
    );
    return known && good.length > 0 ? [{ tool: known.name, places: good }] : [];
  });
  return { ends, runs: o.runs === true, view: readVec(o.view), hands };
}

const readVec = (x: unknown): Vec3 | null =>
  Array.isArray(x) && x.length === 3 && x.every((y) => Number.isFinite(y)) ? (x as unknown as Vec3) : null;

function readScope(from: unknown): SceneInfo['scope'] {
  if (!from || typeof from !== 'object') return null;
  const o = from as Record<string, unknown>;
  const entry = readVec(o.entry),
    target = readVec(o.target);
  return entry && target ? { entry, target, angle: Math.max(0, Math.min(1.3, num(o.angle, Math.PI / 6))) } : null;
}

function readLesion(from: unknown): Lesion | null {
  if (!from || typeof from !== 'object') return null;
  for (const [shape, n] of [
    ['sphere', 4],
    ['box', 6],
    ['half_space', 6],
  ] as const) {
    const v = (from as Record<string, unknown>)[shape];
    if (Array.isArray(v) && v.length === n && v.every((x) => Number.isFinite(x)))
      return { shape, values: v as number[] };
  }
  return null;
}
