import './ui/style.css';
import { App } from './app';
import type { Engine } from './engine/engine';
import { SocketEngine } from './engine/socket_engine';
import type { QualityLevel } from './scene/materials';
import { kSkinningDeclarations } from './scene/skinning';
import { softwareRendering } from './scene/stage';
import { pickPoint, pickRest, snapshot } from './snapshot';
import { bindControls } from './ui/controls';

declare global {
  interface Window {
    kerf: {
      state(): Record<string, unknown>;
      pickRest(x: number, y: number, z: number): [number, number] | null;
      pickPoint(x: number, y: number, z: number): [number, number];
      look(azimuth: number, elevation: number, distance?: number, target?: [number, number, number]): void;
      app: App;
      skinningSource: string;
    };
  }
}

async function start(): Promise<void> {
  const query = new URLSearchParams(location.search);
  const software = softwareRendering();
  if (software === null) {
    const banner = document.getElementById('banner')!;
    banner.textContent =
      'This browser has no WebGL 2, which the view needs. Try a current Firefox, Chromium or Safari.';
    banner.hidden = false;
    return;
  }
  document.documentElement.toggleAttribute('data-software', software);
  const wanted = query.get('quality');
  const quality: QualityLevel | 'auto' = wanted === 'full' || wanted === 'low' || wanted === 'lite' ? wanted : 'auto';
  let engine: Engine;
  if (query.get('engine') === 'mock') {
    const { MockEngine } = await import('./engine/mock_engine');
    const rings = Number(query.get('rings')) || 28;
    engine = new MockEngine({ rings, segments: Math.round(3.4 * rings) });
  } else if ((query.get('engine') ?? document.documentElement.dataset.engine) === 'worker') {
    const { WorkerEngine } = await import('./engine/worker_engine');
    // A page in one file has it all in itself.
    const inside = document.getElementById('kerf-inside')?.textContent;
    engine = new WorkerEngine({
      from: inside
        ? (JSON.parse(inside) as { code: string; scenes: Record<string, string> })
        : new URL('.', location.href).href,
      scene: query.get('scene') ?? document.documentElement.dataset.scene ?? 'steak',
    });
  } else {
    const url = new URL('engine', location.href);
    url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
    url.search = query.has('token') ? `?token=${encodeURIComponent(query.get('token')!)}` : '';
    url.hash = '';
    engine = new SocketEngine(url.href);
  }
  document.documentElement.toggleAttribute('data-bare', query.get('ui') === '0');
  const view = document.getElementById('view') as HTMLCanvasElement,
    ink = document.getElementById('ink') as HTMLCanvasElement;
  const antialias = quality === 'full' || (quality === 'auto' && !software);
  const app = new App(engine, view, ink, { quality, software, antialias, plain: query.get('stage') === 'plain' });
  bindControls(app);
  window.kerf = {
    state: () =>
      JSON.parse(JSON.stringify(snapshot(app), (_, v: unknown) => (typeof v === 'bigint' ? String(v) : v))) as Record<
        string,
        unknown
      >,
    pickRest: (x, y, z) => pickRest(app, x, y, z),
    pickPoint: (x, y, z) => pickPoint(app, x, y, z),
    look: (a, e, distance, target) => app.lookFrom(a, e, distance, target),
    app,
    skinningSource: kSkinningDeclarations,
  };
  app.start();
}

void start();
