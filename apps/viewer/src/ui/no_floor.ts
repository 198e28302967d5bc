// Says once a scene that nothing lies below what comes loose.
import type { App } from '../app';
import { heldShare } from '../scene/support';
import { remembered } from './dom';

// Shares of the body, seen from above, that lie over obstacles.
const kHolds = 0.9; // from here on they hold what comes loose: at 0.8 the tips of a body may stand out, at 1 a rim does
const kHoldsSome = 0.1; // and below it nearly nothing

const key = (app: App): string => `no-floor-${app.info?.name ?? ''}`;

let found: { of: unknown; over: unknown; share: number } | null = null;

/** Of the body that is shown; null until obstacles are where they belong. */
function held(app: App): number | null {
  const s = app.mesh.state;
  if (!s || !app.info || !app.bodyShown || !app.things.allPlaced) return null;
  const over = app.things.list[0];
  if (found?.of === s && found.over === over) return found.share;
  const [x, y, z] = app.info.gravity;
  const surfaces = app.things.placed
    .filter(({ thing }) => !thing.tool)
    .flatMap(({ thing, group }) =>
      thing.parts.map((p) => ({ ...p, position: group.position, turn: group.quaternion })),
    );
  found = { of: s, over, share: heldShare(s.rest, s.nv, [-x, -y, -z], surfaces) };
  return found.share;
}

/** Words for the hint, until they were read: in scenes with weight where neither a plane nor other obstacles hold what falls. */
export function noFloorHint(app: App): string | null {
  const falls = app.info !== null && app.info.gravity.some((g) => g !== 0);
  if (!falls || app.things.list.some((t) => t.shape === 'plane') || remembered.get(key(app)) !== null) return null;
  const share = held(app);
  if (share === null || share >= kHolds) return null;
  return share < kHoldsSome
    ? 'There is no floor here: what comes loose falls away.'
    : 'There is no floor here: what comes loose falls away, unless an obstacle below it holds it.';
}
export function noFloorRead(app: App): void {
  remembered.set(key(app), '1');
}
