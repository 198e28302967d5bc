// Where the hand of a scene's own commands is.
import type { SceneScript } from '../scene_info';
import type { Vec3 } from '../engine/protocol';
import type { ToolName } from './tools';

export interface Ghost {
  tool: ToolName;
  point: Vec3;
  axis: Vec3;
}

/** Between two places in a straight line; of several hands the one that came last. Null: none is there at that time. */
export function ghostAt(script: Pick<SceneScript, 'hands'>, time: number): Ghost | null {
  let found: Ghost | null = null,
    came = -Infinity;
  for (const { tool, places } of script.hands) {
    const first = places[0]!,
      last = places[places.length - 1]!;
    if (time < first[0]! || time > last[0]! || first[0]! < came) continue;
    const i = Math.max(
      1,
      places.findIndex((p) => p[0]! >= time),
    );
    const a = places[i - 1] ?? first,
      b = places[i] ?? last;
    const f = b[0]! > a[0]! ? Math.min(1, (time - a[0]!) / (b[0]! - a[0]!)) : 1;
    const at = (k: number): number => a[k]! + f * (b[k]! - a[k]!);
    came = first[0]!;
    found = { tool, point: [at(1), at(2), at(3)], axis: [at(4), at(5), at(6)] };
  }
  return found;
}
