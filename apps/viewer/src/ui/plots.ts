// Live plots; loaded when the section is opened first.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import type { App } from '../app';
import type { Series } from '../stats/series';

/** 26,624 as 27k: what stands beside an axis. */
const kCompact = new Intl.NumberFormat('en', { notation: 'compact', maximumSignificantDigits: 3 });
const kColours = ['#d1495b', '#2e86ab', '#e0a030', '#3f9b6b', '#7a5bc0', '#808a94'];

interface Definition {
  title: string;
  x: string;
  names: string[];
  columns: number[];
  source: Series;
  log?: boolean;
  points?: boolean;
}

export function makePlots(app: App, parent: HTMLElement): { update(): void } {
  const definitions: Definition[] = [
    {
      title: 'Step, ms',
      x: 'time, s',
      names: ['median', '99 %', 'mechanics'],
      columns: [1, 2, 3],
      source: app.records.steps,
    },
    { title: 'Pictures a second', x: 'time, s', names: ['fps'], columns: [4], source: app.records.steps },
    { title: 'Contacts', x: 'time, s', names: ['contacts'], columns: [1], source: app.records.contacts },
    {
      title: 'Forces, N',
      x: 'time, s',
      names: ['pressed with', 'on a tool'],
      columns: [2, 3],
      source: app.records.contacts,
    },
    {
      title: 'Cuts, ms by stage',
      x: 'cut',
      names: ['cut and binding', 'embedding', 'surface mesh', 'total'],
      columns: [1, 2, 3, 4],
      source: app.records.cutTimes,
      points: true,
    },
    {
      title: 'Vertices',
      x: 'cut',
      names: ['visual', 'collision', 'simulation'],
      columns: [1, 3, 5],
      source: app.records.counts,
      log: true,
      points: true,
    },
    {
      title: 'Elements',
      x: 'cut',
      names: ['visual', 'collision', 'simulation'],
      columns: [2, 4, 6],
      source: app.records.counts,
      log: true,
      points: true,
    },
  ];
  parent.replaceChildren();
  const width = Math.max(200, parent.clientWidth);
  const themed = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const plots = definitions.map((d) => {
    const box = document.createElement('div');
    box.className = 'plot';
    const title = document.createElement('h3');
    title.textContent = d.title;
    box.append(title);
    parent.append(box);
    const axis = {
      stroke: () => themed('--dim'),
      grid: { stroke: () => themed('--line'), width: 1 },
      ticks: { show: false },
      font: '11px system-ui',
      size: 34,
    };
    const plot = new uPlot(
      {
        width,
        height: 128,
        cursor: { y: false },
        legend: { live: true },
        scales: {
          x: { time: false },
          y: d.log ? { distr: 3 } : { range: (_u, lo, hi) => [Math.min(0, lo ?? 0), Math.max(1e-3, (hi ?? 1) * 1.08)] },
        },
        axes: [
          { ...axis, size: 22 },
          {
            ...axis,
            size: 46,
            values: (_u, at) => at.map((v: number | null) => (v === null ? '' : kCompact.format(v))),
          },
        ],
        series: [
          { label: d.x },
          ...d.names.map((label, i) => ({
            label,
            stroke: kColours[i % kColours.length]!,
            width: 1.6,
            points: { show: d.points ?? false, size: 5 },
          })),
        ],
      },
      [[], ...d.names.map(() => [])] as unknown as uPlot.AlignedData,
      box,
    );
    return { d, plot, shown: -1, last: NaN };
  });
  return {
    update() {
      const now = parent.clientWidth;
      for (const p of plots) {
        const data = p.d.source.data(),
          x = data[0]!,
          end = Number(x[x.length - 1] ?? NaN);
        if (now > 0 && Math.abs(now - p.plot.width) > 2) p.plot.setSize({ width: now, height: 128 });
        if (p.shown === x.length && Object.is(p.last, end)) continue;
        p.shown = x.length;
        p.last = end;
        p.plot.setData([x, ...p.d.columns.map((c) => data[c]!)] as unknown as uPlot.AlignedData);
        if (p.plot.cursor.idx == null && x.length > 0) p.plot.setLegend({ idx: x.length - 1 });
      }
    },
  };
}
