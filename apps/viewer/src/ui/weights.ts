// What pieces weigh, in words: beside the pointer, in a list, and at trays.
import { Vector3 } from 'three';
import type { App } from '../app';
import { kNoNode } from '../engine/protocol';
import type { Weight } from '../scene/scales';
import type { ToolName } from '../tools/tools';
import { byId, setText } from './dom';

const kListed = 8;
const kWhole = 0.9995; // of the uncut body: its share goes without saying
const kHolds: ReadonlySet<ToolName> = new Set(['grasp', 'take'] as const);
const kTrayEvery = 500; // ms
const kBeside = 18; // pixels from the pointer

export function massWords(kg: number): string {
  const g = 1000 * kg;
  if (!(g > 0)) return '0 g';
  if (g >= 999.5) return `${kg.toFixed(2)} kg`;
  if (g >= 9.95) return `${g.toFixed(0)} g`;
  if (g >= 0.995) return `${g.toFixed(1)} g`;
  if (g >= 0.00995) return `${g.toFixed(2)} g`;
  return g >= 0.0005 ? `${(1000 * g).toFixed(0)} mg` : '<1 mg';
}
export function shareWords(share: number): string {
  const percent = 100 * share;
  if (percent >= 9.95 || percent === 0) return `${percent.toFixed(0)} %`;
  return percent >= 0.05 ? `${percent.toFixed(1)} %` : '<0.1 %';
}
export function weightWords(w: Weight): string {
  return w.share > kWhole ? massWords(w.mass) : `${massWords(w.mass)}, ${shareWords(w.share)}`;
}
export function trayWords(on: Weight): string {
  return `tray: ${on.mass > 0 ? weightWords(on) : '0 g'}`;
}
/** Weight and share of the heaviest pieces; how many others there are. */
export function listRows(list: readonly Weight[]): { rows: [string, string][]; smaller: number } {
  const shown = list.slice(0, kListed);
  return {
    rows: shown.map((w) => [massWords(w.mass), shareWords(w.share)]),
    smaller: list.length - shown.length,
  };
}

/** A label of the picture; it costs nothing where nothing changes. */
class Label {
  readonly element = document.createElement('div');
  private at = '';
  private width = 0;
  private readonly middle: boolean; // it stands on its place, not beside it
  constructor(kind: 'beside' | 'tray') {
    this.middle = kind === 'tray';
    this.element.className = `weight ${kind}`;
    this.element.hidden = true;
    byId('labels').append(this.element);
  }
  put(text: string | null, x: number, y: number): void {
    this.element.hidden = text === null;
    if (text === null) return;
    if (this.element.textContent !== text) {
      this.element.textContent = text;
      this.width = this.element.offsetWidth;
    }
    if (!this.middle && x + this.width > innerWidth) x -= this.width + 2 * kBeside; // on the pointer's other side
    const at = `${x.toFixed(1)}px ${y.toFixed(1)}px`;
    if (at !== this.at) this.element.style.translate = at;
    this.at = at;
  }
  remove(): void {
    this.element.remove();
  }
}

/** Of a tray: in space, and in the window. */
interface Corner {
  place: Vector3;
  at: [number, number];
}

/** Returns what shows or hides the list. */
export function bindWeights(app: App, closePanel: () => void): () => void {
  const pointed = new Label('beside'),
    up = new Vector3();
  let trays: { label: Label; top: Vector3[]; words: string | null }[] = [],
    weighedAt = -Infinity,
    free = 0, // pixels from the top, below the header
    bottom = Infinity, // and above the controls
    listed = '',
    asked: boolean | null = null; // what a person has chosen; null: shown where there is room and something to compare
  const roomy = matchMedia('(min-width: 721px) and (min-height: 521px)');
  const panelOpen = (): boolean => !byId('panel').hidden;

  /** What the forceps hold, or else what they would take hold of. */
  const point = (): void => {
    const at = app.hand.at;
    if (!kHolds.has(app.tool) || !app.toolAllowed || app.showing) return pointed.put(null, 0, 0);
    const held = app.grip.holds;
    const weight = held
      ? app.scales.of(held.copy)
      : at && app.hover.under !== kNoNode
        ? app.scales.of(app.hover.under)
        : null;
    const [x, y] = held ? app.stage.project(held.point) : at ? [at.x, at.y] : [0, 0];
    pointed.put(weight ? weightWords(weight) : null, x + kBeside, y - kBeside);
  };

  const weighTrays = (now: number): void => {
    if (now - weighedAt > kTrayEvery) {
      weighedAt = now;
      free = byId('readout').getBoundingClientRect().bottom + kBeside;
      bottom = byId('transport').getBoundingClientRect().top - kBeside;
      up.copy(app.up);
      const found = app.scales.trays(up, app.stage.size);
      while (trays.length > found.length) trays.pop()!.label.remove();
      found.forEach(({ top, on }, i) => {
        const tray = (trays[i] ??= { label: new Label('tray'), top, words: null });
        tray.top = top;
        if (on) tray.words = trayWords(on);
      });
    }
    for (const t of trays) {
      // From the middle of the edge that is highest in the picture, where what lies there is seen, down to below the header.
      const [a, b, c, d] = t.top
        .map((place) => ({ place, at: app.stage.project(place.toArray()) }))
        .sort((p, q) => p.at[1] - q.at[1]) as [Corner, Corner, Corner, Corner];
      const high = [0, 1].map((k) => (a.at[k]! + b.at[k]!) / 2),
        low = [0, 1].map((k) => (c.at[k]! + d.at[k]!) / 2);
      const down = Math.max(0, Math.min(1, (free - high[1]!) / Math.max(1, low[1]! - high[1]!)));
      const [x, y] = high.map((h, k) => h + down * (low[k]! - h)) as [number, number];
      const place = a.place.clone().lerp(b.place, 0.5).lerp(c.place.clone().lerp(d.place, 0.5), down);
      const seen =
        !app.stage.scopeOn &&
        y < bottom &&
        t.top.some((p) => app.stage.sees(p)) &&
        app.scales.sees(app.stage.camera.position, place, up);
      t.label.put(seen ? t.words : null, x, y);
    }
  };

  const showList = (): void => {
    const list = app.scales.list();
    const on = (asked ?? (roomy.matches && app.scoreNow === null && (list?.length ?? 0) > 1)) && list !== null;
    // In a cut nobody knows: the list stays as it was.
    if (list !== null || asked === false) byId('weights').hidden = !on;
    byId('pieces').setAttribute('aria-expanded', String(!byId('weights').hidden && !panelOpen()));
    if (!list) return;
    const { rows, smaller } = listRows(list),
      text = JSON.stringify([rows, smaller]);
    if (text === listed) return;
    listed = text;
    byId('weights-rows').replaceChildren(
      ...rows.map(([mass, share], i) => {
        const row = document.createElement('tr'),
          name = document.createElement('th'),
          of = document.createElement('td');
        name.scope = 'row';
        name.textContent = mass;
        of.textContent = share;
        row.style.setProperty('--share', `${(100 * list[i]!.share).toFixed(1)}%`);
        row.append(name, of);
        return row;
      }),
    );
    byId('weights-more').hidden = smaller === 0;
    setText('weights-more', `and ${smaller} smaller`);
  };

  let listedAt = -Infinity;
  const loop = (now: number): void => {
    requestAnimationFrame(loop);
    point();
    weighTrays(now);
    if (now - listedAt < 200) return;
    listedAt = now;
    showList();
  };
  requestAnimationFrame(loop);

  const toggle = (): void => {
    asked = byId('weights').hidden || panelOpen();
    closePanel();
    showList();
  };
  byId('pieces').onclick = toggle;
  return toggle;
}
