// Says once a scene that nothing lies below what comes loose.
import type { App } from '../app';
import { remembered } from './dom';

const key = (app: App): string => `no-floor-${app.info?.name ?? ''}`;

/** Words for the hint, until they were read: in scenes with weight and without a plane among their obstacles. */
export function noFloorHint(app: App): string | null {
  const falls = app.info !== null && app.info.gravity.some((g) => g !== 0);
  if (!falls || app.things.list.some((t) => t.shape === 'plane') || remembered.get(key(app)) !== null) return null;
  return 'There is no floor here: what comes loose falls away.';
}
export function noFloorRead(app: App): void {
  remembered.set(key(app), '1');
}
