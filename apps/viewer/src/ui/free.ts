// What of the window the controls leave free for the picture.
import { kNothingOver, type Insets } from '../scene/framing';
import { byId } from './dom';

const kOver = ['readout', 'tools', 'transport', 'size', 'score', 'hint'] as const;

/** Boxes over a window are left out from the side where that costs least. */
export function insetsOf(
  boxes: readonly { left: number; top: number; right: number; bottom: number }[],
  width: number,
  height: number,
): Insets {
  const over = { ...kNothingOver };
  for (const b of boxes) {
    const lost: Insets = { left: b.right, top: b.bottom, right: width - b.left, bottom: height - b.top };
    const cost = (s: keyof Insets): number => lost[s] / (s === 'left' || s === 'right' ? width : height);
    const side = (['top', 'bottom', 'left', 'right'] as const).reduce((a, s) => (cost(s) < cost(a) ? s : a));
    over[side] = Math.max(over[side], lost[side]);
  }
  return over;
}

export function overView(): Insets {
  const shown = [...kOver.map((id) => byId(id)), byId('brand').parentElement!].filter(
    (e) => e.getClientRects().length > 0 && getComputedStyle(e).visibility !== 'hidden',
  );
  return insetsOf(
    shown.map((e) => e.getBoundingClientRect()),
    innerWidth,
    innerHeight,
  );
}
