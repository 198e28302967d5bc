// Says how many pieces have left the picture, and shows them on request.
import type { App } from '../app';
import { byId, setText } from './dom';

const kPatience = 500; // ms for which a piece is away before it is spoken of

/** How many are spoken of: none until some have been away for a while. */
export class Away {
  private since = -1;

  at(now: number, away: number): number {
    if (away === 0) this.since = -1;
    else if (this.since < 0) this.since = now;
    return away > 0 && now - this.since >= kPatience ? away : 0;
  }
}

export function awayWords(away: number, pieces: number): string {
  if (pieces === 1) return 'The body is out of view. Show it';
  return away === 1 ? '1 piece is out of view. Show it' : `${away} pieces are out of view. Show them`;
}

/** Returns what looks whether something is away; to be called a few times a second. */
export function bindOutOfView(app: App, changed: () => void): () => void {
  const button = byId<HTMLButtonElement>('away-show'),
    box = byId('away'),
    away = new Away();
  button.onclick = () => app.lookAtAll(true);
  return () => {
    const { all, outside } = app.pieceView.count();
    const told = away.at(performance.now(), outside);
    if (told > 0) setText('away-show', awayWords(told, all));
    if (box.hidden === (told === 0)) return;
    if (told === 0 && document.activeElement === button) byId('view').focus({ preventScroll: true });
    box.hidden = told === 0;
    changed();
  };
}
