// The mark at the rim of the arthroscope's picture: it shows to which side the optic looks.
import type { App } from '../app';
import { byId } from './dom';

export interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

// Pixels, but for the rim.
const kRim = 0.945; // of half the shorter side of the window: just outside of the round picture
const kHalf = 9; // of the mark, with a gap
const kInward = 6; // by which it makes way; half as far costs more, twice as far leaves a gap
const kNearest = 0.2; // of the way to the rim: nearer to the middle it would hide what is worked on

/** How far from the middle the mark lies that `way` (of length 1) points to: at the rim, or nearer where a card would cover it. */
export function markReach(middle: [number, number], way: [number, number], rim: number, cards: readonly Box[]): number {
  for (let reach = rim; reach >= kNearest * rim; reach -= kInward) {
    const x = middle[0] + reach * way[0],
      y = middle[1] + reach * way[1];
    const covered = cards.some(
      (c) => x + kHalf > c.left && x - kHalf < c.right && y + kHalf > c.top && y - kHalf < c.bottom,
    );
    if (!covered) return reach;
  }
  return rim;
}

/** To be called when the optic turns, and a few times a second: cards come and go. */
export function placeNotch(app: App): void {
  if (!app.stage.scopeOn) return;
  const mask = byId('scope-mask'),
    angle = Math.PI + app.stage.scope.turnedBy, // at rest it looks down: the mark is at the bottom of the picture
    box = mask.getBoundingClientRect();
  const cards = [...document.querySelectorAll('.card')]
    .map((e) => e.getBoundingClientRect())
    .filter((r) => r.width > 0);
  const reach = markReach(
    [box.left + box.width / 2, box.top + box.height / 2],
    [Math.sin(angle), -Math.cos(angle)],
    (kRim * Math.min(box.width, box.height)) / 2,
    cards,
  );
  mask.style.setProperty('--roll', `${(180 / Math.PI) * angle}deg`);
  mask.style.setProperty('--reach', `${reach.toFixed(1)}px`);
}
