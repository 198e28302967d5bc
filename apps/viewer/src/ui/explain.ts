// The paper's figures that are views of a body, and a walk through them in the visitor's own cut.
import type { App } from '../app';
import { Outcome } from '../engine/protocol';
import type { ViewName } from '../scene/overlays';
import { byId, setText } from './dom';

interface Figure {
  number: number;
  title: string;
  views: ViewName[];
  /** What is seen there of a cut. */
  words(app: App): string;
}

export const kFigures: Figure[] = [
  {
    number: 1,
    title: 'the three meshes',
    views: ['wireframe', 'collision', 'hexahedra'],
    words: () =>
      'Your cut is in three meshes at once. The fine one (black) is what you see, the coarse one (orange) is what touches and is cut, and the hexahedra (coloured) carry both as they move.',
  },
  {
    number: 5,
    title: 'what visual vertices are bound to',
    views: ['wireframe', 'collision', 'feet'],
    words: () =>
      'The fine mesh follows the coarse one to both sides of the cut. Each of its vertices is bound to a vertex (green), an edge (blue) or a triangle (red) of the coarse mesh.',
  },
  {
    number: 18,
    title: 'collision mesh and hexahedra after a cut',
    views: ['collision', 'hexahedra'],
    words: (app) => {
      const cut = app.lastCut,
        n = cut?.outcome === Outcome.Cut ? cut.trianglesCut : 0;
      const went = n > 1 ? `The last cut went through ${n} triangles of the coarse mesh. ` : '';
      return `${went}A hexahedron that is parted gets a copy for each side, in a colour of its own, so the two move apart.`;
    },
  },
];

export interface Explanation {
  /** Opens it, or closes it. */
  toggle(): void;
  /** True when it was open. */
  close(): boolean;
  /** The number of cuts has changed. */
  update(): void;
}

/** `setViews`: shows these and no others. */
export function bindExplanation(
  app: App,
  setViews: (views: readonly ViewName[]) => void,
  hidePanel: () => void,
): Explanation {
  const card = byId('explain'),
    button = byId<HTMLButtonElement>('explain-open'),
    back = byId<HTMLButtonElement>('explain-back'),
    next = byId<HTMLButtonElement>('explain-next');
  let before: ViewName[] = [],
    at = 0;
  const isCut = (): boolean => app.undoDepth > 0;
  const show = (step: number): void => {
    at = step;
    const figure = kFigures[step]!;
    setViews(figure.views);
    setText('explain-title', `${step + 1} of ${kFigures.length}: ${figure.title}`);
    setText('explain-words', figure.words(app));
    setText('explain-note', `As in the paper's figure ${figure.number}.`);
    back.disabled = step === 0;
    next.textContent = step === kFigures.length - 1 ? 'Done' : 'Next';
  };
  const close = (): boolean => {
    if (card.hidden) return false;
    const focused = card.contains(document.activeElement);
    card.hidden = true;
    document.documentElement.removeAttribute('data-explaining');
    setViews(before);
    if (focused) byId('view').focus({ preventScroll: true });
    return true;
  };
  const open = (): void => {
    if (!isCut()) return;
    before = (Object.keys(app.overlays.shown) as ViewName[]).filter((v) => app.overlays.shown[v]);
    hidePanel();
    card.hidden = false;
    document.documentElement.setAttribute('data-explaining', '');
    show(0);
    next.focus({ preventScroll: true });
  };
  button.onclick = open;
  back.onclick = () => show(at - 1);
  next.onclick = () => (at + 1 < kFigures.length ? show(at + 1) : close());
  byId('explain-close').onclick = close;
  return {
    toggle() {
      if (!close()) open();
    },
    close,
    update() {
      button.disabled = !isCut();
      button.title = isCut() ? 'Three views of what was cut, one after the other (,)' : 'Cut something first';
      if (!isCut()) close();
    },
  };
}
