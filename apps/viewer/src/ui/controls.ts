// Buttons, selects and readouts of index.html, bound to the app.
import type { App } from '../app';
import type { SceneInfo } from '../scene_info';
import {
  CommandCode,
  Outcome,
  type CutReport,
  type Loading,
  type Role,
  type Score,
  type Stats,
} from '../engine/protocol';
import type { EngineState } from '../engine/engine';
import type { QualityLevel } from '../scene/materials';
import type { ViewName } from '../scene/overlays';
import { kMissed, kTools, toolInfo, type ToolName } from '../tools/tools';
import { byId, download, remembered, setIcon, setText, short, withUnit } from './dom';
import { overView } from './free';
import { bindExplanation, kFigures } from './explain';
import { bindKeys, type Shortcut } from './keyboard';
import { showLegend } from './legend';
import { noFloorHint, noFloorRead } from './no_floor';
import { placeNotch } from './notch';
import { bindOutOfView } from './out_of_view';
import { bindScenes, goalHint, goalRead } from './scenes';
import { bindUpload } from './upload';
import { bindWeights } from './weights';

const kViews: { name: ViewName; title: string; key: string; tip: string }[] = [
  { name: 'shaded', title: 'Shaded', key: 'S', tip: 'The visual mesh with its material' },
  { name: 'wireframe', title: 'Wireframe', key: 'W', tip: 'Edges of the visual mesh, in black' },
  { name: 'collision', title: 'Collision', key: 'O', tip: 'The collision mesh, in orange' },
  { name: 'hexahedra', title: 'Hexahedra', key: 'X', tip: 'Hexahedra of the simulation, one colour per copy' },
  {
    name: 'bound',
    title: 'Bound',
    key: 'B',
    tip: 'Visual vertices and chains bound to collision vertices and edges, in red',
  },
  { name: 'links', title: 'Links', key: 'L', tip: 'From collision vertices to their visual vertices, in blue' },
  {
    name: 'feet',
    title: 'Feet',
    key: 'N',
    tip: 'Where visual vertices are bound: green to a collision vertex, blue to an edge, red to a triangle',
  },
];
const kSpeeds = [0.1, 0.25, 0.5, 1, 2];

export function bindControls(app: App): void {
  const select = (id: string): HTMLSelectElement => byId<HTMLSelectElement>(id);
  const input = (id: string): HTMLInputElement => byId<HTMLInputElement>(id);
  const button = (id: string): HTMLButtonElement => byId<HTMLButtonElement>(id);

  const toast = (text: string, error = false): void => {
    const last = byId('toasts').lastElementChild;
    if (last?.textContent === text) last.remove(); // once is enough
    const p = document.createElement('p');
    p.textContent = text;
    p.classList.toggle('error', error);
    const box = byId('toasts');
    while (box.childElementCount > 2) box.firstElementChild!.remove();
    box.append(p);
    setTimeout(() => p.remove(), error ? 7000 : 3500);
  };

  // Theme
  const system = matchMedia('(prefers-color-scheme: dark)');
  const applyTheme = (): void => {
    const mode = select('theme').value,
      dark = mode === 'dark' || (mode === 'auto' && system.matches);
    document.documentElement.dataset.theme = dark ? 'dark' : 'light';
    app.setTheme(dark);
  };
  select('theme').value = remembered.get('theme') ?? 'auto';
  select('theme').onchange = () => {
    remembered.set('theme', select('theme').value);
    applyTheme();
  };
  system.addEventListener('change', applyTheme);
  applyTheme();

  // Tools
  const hint = (text: string | null): void => {
    byId('hint').hidden = text === null;
    if (text) setText('hint-text', text);
  };
  const sceneRead = (): void => {
    noFloorRead(app);
    goalRead(app);
  };
  const fingers = matchMedia('(pointer: coarse)');
  const wordsOf = (tool: ToolName): string => {
    const { hint: words, touch } = toolInfo(tool);
    return fingers.matches ? (touch ?? words) : words;
  };
  /** What to try and how the tool is used, the first time; for a page that watches, what its drags do. */
  const showHint = (): void => {
    const first = remembered.get(`used-${app.tool}`) === null;
    if (app.showing) hint('Watch. The tools are yours when it has ended, or at once: Your turn.');
    else if (app.shown && app.info?.lesion && app.toolAllowed)
      hint('This operation was shown. Start again for one of your own.');
    else if ((app.connection === 'live' || app.readOnly) && !app.toolAllowed && app.tool !== 'hand')
      hint(
        `You are watching: a drag turns the view.${app.readOnly ? '' : ' Another page holds the tools; C takes them.'}`,
      );
    else hint([goalHint(app), first ? wordsOf(app.tool) : null, noFloorHint(app)].filter(Boolean).join(' ') || null);
  };
  fingers.addEventListener('change', showHint);
  const tools = byId('tools');
  for (const t of kTools) {
    const b = document.createElement('button');
    b.type = 'button';
    b.dataset.tool = t.name;
    b.setAttribute('role', 'radio');
    b.setAttribute('aria-label', t.title);
    b.title = `${t.title} (${t.key}). ${t.hint}`;
    b.innerHTML = `<svg aria-hidden="true"><use href="#i-${t.name}"/></svg><small aria-hidden="true">${t.key}</small><span class="word" aria-hidden="true">${t.word}</span>`;
    b.onclick = () => chooseTool(t.name);
    tools.append(b);
  }
  const usable = (name: ToolName): boolean =>
    name === 'rigid' ? app.things.list.some((t) => t.tool) : name !== 'probe' || app.hasProbe;
  const showTool = (): void => {
    for (const b of tools.querySelectorAll('button')) {
      const on = b.dataset.tool === app.tool;
      b.setAttribute('aria-checked', String(on));
      b.tabIndex = on ? 0 : -1;
      b.hidden = !usable(b.dataset.tool as ToolName);
      if (on) b.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    }
  };
  function chooseTool(name: ToolName): void {
    app.setTool(name);
    showTool();
    showSize();
    showHint();
  }
  new ResizeObserver(showTool).observe(tools); // the chosen one stays in sight
  tools.addEventListener('keydown', (e) => {
    const step =
      e.key === 'ArrowDown' || e.key === 'ArrowRight' ? 1 : e.key === 'ArrowUp' || e.key === 'ArrowLeft' ? -1 : 0;
    if (step === 0) return;
    e.preventDefault();
    const list = kTools.filter((t) => usable(t.name)),
      n = list.length,
      i = list.findIndex((t) => t.name === app.tool);
    chooseTool(list[(i + step + n) % n]!.name);
    tools.querySelector<HTMLButtonElement>('[aria-checked="true"]')?.focus();
  });
  byId('hint-close').onclick = () => {
    if (app.toolAllowed) remembered.set(`used-${app.tool}`, '1');
    if (app.toolAllowed) sceneRead();
    hint(null);
  };

  // Size of the instrument: even steps are equal ratios.
  const metres = (x: number): string => (x < 0.1 ? `${short(1000 * x)} mm` : `${short(x)} m`);
  function showSize(): void {
    const size = toolInfo(app.tool).size;
    byId('size').hidden = !size;
    document.documentElement.toggleAttribute('data-sized', size !== undefined);
    if (!size) return;
    setText('size-label', size.title);
    const part = app.sizes.get(app.tool) ?? size.own;
    input('size-range').value = String(Math.log(part / size.least) / Math.log(size.most / size.least));
    setText('size-out', metres(app.instrumentSize(app.tool)));
  }
  const setSize = (at: number): void => {
    const size = toolInfo(app.tool).size;
    if (!size) return;
    app.setInstrumentSize(app.tool, size.least * (size.most / size.least) ** Math.max(0, Math.min(1, at)));
    showSize();
  };
  input('size-range').addEventListener('input', () => setSize(Number(input('size-range').value)));
  const changeSize = (by: number): void => setSize(Number(input('size-range').value) + by);

  // Transport
  const command = (code: number, value: number[] = [], text = ''): void => {
    app.command(code, value, text);
  };
  button('play').onclick = () => app.play(!app.playing);
  button('step').onclick = () => {
    app.play(false);
    command(CommandCode.Step, [1]);
  };
  button('undo').onclick = () => command(CommandCode.Undo);
  button('redo').onclick = () => command(CommandCode.Redo);
  button('reset').onclick = () => app.reset();
  button('show').onclick = () => app.show(!app.showing);
  const showShow = (): void => {
    // What was shown is nobody's score.
    byId('finish').hidden = app.shown;
    const b = button('show');
    b.hidden = !app.info?.script || !app.toolAllowed;
    b.textContent = app.showing ? 'Your turn' : 'Show me';
    b.title = app.showing
      ? 'Stop here; the scene starts anew for your hands (;)'
      : 'What this scene was made for, done by itself (;)';
    document.documentElement.toggleAttribute('data-showing', app.showing);
  };
  button('home').onclick = () => app.resetCamera();
  button('scope').onclick = () => app.setScope(!app.stage.scopeOn);
  button('picture').onclick = () => void savePicture();
  select('speed').onchange = () => command(CommandCode.Speed, [Number(select('speed').value)]);
  const changeSpeed = (step: number): void => {
    const i = kSpeeds.findIndex((s) => s >= app.speed - 1e-6),
      j = Math.max(0, Math.min(kSpeeds.length - 1, (i < 0 ? 3 : i) + step));
    command(CommandCode.Speed, [kSpeeds[j]!]);
  };
  async function savePicture(): Promise<void> {
    try {
      const name = `kerf-${app.info?.name ?? 'picture'}.png`;
      download(name, await app.picture());
      toast(`Saved ${name}.`);
    } catch (e) {
      toast(e instanceof Error ? e.message : String(e), true);
    }
  }

  // Panel
  const panel = byId('panel'),
    toggle = button('panel-toggle');
  const showPanel = (on: boolean): void => {
    panel.hidden = !on;
    toggle.setAttribute('aria-expanded', String(on));
    toggle.setAttribute('aria-pressed', String(on));
  };
  toggle.title = 'Settings, views and plots (M)';
  toggle.onclick = () => showPanel(panel.hidden);
  const setView = (name: ViewName, on: boolean): void => {
    app.setView(name, on);
    input(`view-${name}`).checked = on;
  };
  for (const v of kViews) {
    const label = document.createElement('label');
    label.title = `${v.tip} (${v.key})`;
    label.innerHTML = `<input type="checkbox" id="view-${v.name}"><span>${v.title}</span><kbd>${v.key}</kbd>`;
    byId('views').append(label);
    const box = input(`view-${v.name}`);
    box.checked = app.overlays.shown[v.name];
    box.onchange = () => setView(v.name, box.checked);
  }
  const setContacts = (on: boolean): void => {
    app.setContacts(on);
    input('view-contacts').checked = on;
  };
  const contactsLabel = document.createElement('label');
  contactsLabel.title =
    'What touches: points, normals and forces; blue with obstacles, orange with tools, violet with itself (K)';
  contactsLabel.innerHTML = '<input type="checkbox" id="view-contacts"><span>Contacts</span><kbd>K</kbd>';
  byId('views').append(contactsLabel);
  input('view-contacts').onchange = () => setContacts(input('view-contacts').checked);
  select('quality').value = app.drawing.mode;
  select('quality').onchange = () => app.setQuality(select('quality').value as QualityLevel | 'auto');
  const setViews = (views: readonly ViewName[]): void => {
    for (const v of kViews) setView(v.name, views.includes(v.name));
  };
  const explanation = bindExplanation(app, setViews, () => showPanel(false));
  for (const { number, title, views } of kFigures) {
    const b = document.createElement('button');
    b.type = 'button';
    b.className = 'small';
    b.textContent = String(number);
    b.title = `Figure ${number}: ${title}`;
    b.setAttribute('aria-label', b.title);
    b.onclick = () => setViews(views);
    byId('figures').append(b);
  }
  const toggleWeights = bindWeights(app, () => showPanel(false));
  button('latency-clear').onclick = () => app.latency.reset();

  // Material and gravity: sent while a slider moves, but not oftener than the engine can follow.
  const throttled = (run: () => void, ms: number): (() => void) => {
    let timer = 0,
      again = false;
    return () => {
      if (timer !== 0) {
        again = true;
        return;
      }
      run();
      timer = window.setTimeout(function next() {
        timer = 0;
        if (again) {
          again = false;
          run();
          timer = window.setTimeout(next, ms);
        }
      }, ms);
    };
  };
  const slider = (id: string, show: (x: number) => string): void => {
    input(id).addEventListener('input', () => setText(`${id}-out`, show(Number(input(id).value))));
  };
  const young = (x: number): string => withUnit(10 ** x, 'Pa');
  slider('young', young);
  slider('poisson', (x) => x.toFixed(2));
  slider('density', (x) => `${x} kg/m³`);
  slider('gravity', (x) => `${x.toFixed(1)} m/s²`);
  const sendMaterial = throttled(
    () =>
      command(CommandCode.Material, [
        10 ** Number(input('young').value),
        Number(input('poisson').value),
        Number(input('density').value),
      ]),
    120,
  );
  // Scripts that follow the engine's values dispatch untrusted events, which are not sent back.
  for (const id of ['young', 'poisson', 'density'])
    input(id).addEventListener('input', (e) => {
      if (e.isTrusted) sendMaterial();
    });
  let lastGravity = 9.81;
  const setGravity = (g: number): void => {
    input('gravity').value = String(g);
    setText('gravity-out', `${g.toFixed(1)} m/s²`);
    const [x, y] = app.info?.gravity ?? [0, 0, 0];
    command(CommandCode.Gravity, [x, y, -g]);
  };
  const sendGravity = throttled(() => setGravity(Number(input('gravity').value)), 120);
  input('gravity').addEventListener('input', (e) => {
    if (e.isTrusted) sendGravity();
  });
  const toggleGravity = (): void => {
    const now = Number(input('gravity').value);
    if (now !== 0) {
      lastGravity = now;
      setGravity(0);
    } else setGravity(lastGravity);
  };
  button('fix-rim').onclick = () => command(CommandCode.FixAll, [1]);
  button('fix-none').onclick = () => command(CommandCode.FixAll, [0]);

  // Files
  const record = (): void => app.setRecording(!app.recording);
  button('record').onclick = button('recording').onclick = record;
  let recordingSince: number | null = null;
  const showRecording = (since: number | null): void => {
    recordingSince = since;
    button('record').setAttribute('aria-pressed', String(since !== null));
    button('record').textContent = since !== null ? 'Stop and save' : 'Record';
    button('recording').hidden = since === null;
    showRecordingTime();
  };
  const showRecordingTime = (): void => {
    if (recordingSince === null) return;
    const s = Math.floor((performance.now() - recordingSince) / 1000);
    setText('recording-time', `${Math.floor(s / 60)}:${String(s % 60).padStart(2, '0')}`);
  };
  for (const kind of ['obj', 'vtu', 'scene'])
    button(`export-${kind}`).onclick = () => command(CommandCode.Export, [], kind);
  bindUpload(app, toast);

  // Score
  const result = byId<HTMLDialogElement>('result');
  const kOver = 'over'; // the operation that the dialog tells of has ended
  const showScore = (s: Score | null): void => {
    byId('score').hidden = s === null;
    if (!s) {
      if (result.open) result.close(kOver);
      return;
    }
    const mm3 = 1e9 * s.healthyRemoved;
    setText('s-lesion', `${(100 * s.lesionRemoved).toFixed(0)} %`);
    byId<HTMLMeterElement>('s-meter').value = s.lesionRemoved;
    setText('s-healthy', `${short(mm3)} mm³ (${(100 * s.healthyShare).toFixed(1)} %)`);
    setText('s-rough', `${short(1e6 * s.roughness)} µm`);
    setText('s-force', `${short(s.largestForce)} N`);
    setText('s-loose', String(s.loosePieces));
    setText('s-time', `${s.time.toFixed(1)} s`);
    if (result.open) showResult(s);
  };
  /** The dialog tells what the panel tells: the engine goes on until it hears of the pause. */
  function showResult(s: Score): void {
    byId('result-table').replaceChildren(byId('score').querySelector('table')!.cloneNode(true));
    for (const e of byId('result-table').querySelectorAll('[id]')) e.removeAttribute('id');
    const left = s.lesionRemoved < 0.9 ? 'Some of the lesion is left.' : 'The lesion is out.';
    const loose =
      s.loosePieces > 0
        ? ` ${s.loosePieces === 1 ? 'A loose piece is' : `${s.loosePieces} loose pieces are`} left behind.`
        : '';
    setText('result-words', left + loose);
  }
  function finish(): void {
    const s = app.scoreNow;
    if (!s || result.open || app.shown) return;
    app.play(false);
    showResult(s);
    result.returnValue = '';
    result.showModal();
  }
  // Finish pauses. Whatever closes the dialog goes on: the button, Escape, the cross.
  result.addEventListener('close', () => {
    if (!result.open && result.returnValue !== kOver) app.play(true); // it may be open again: the event comes late
  });
  button('finish').onclick = finish;
  button('result-save').onclick = () => {
    // What is recorded began when the scene was loaded or reset, whenever the button is pressed.
    if (!app.recording) command(CommandCode.Recording, [1]);
    app.setRecording(false);
  };
  button('result-again').onclick = () => {
    result.close(kOver);
    app.reset();
    app.play(true);
  };
  button('result-on').onclick = () => result.close();

  // Scenes, roles
  button('loading-stop').onclick = () => command(CommandCode.StopLoading);
  select('unit').onchange = () => command(CommandCode.Unit, [Number(select('unit').value)]);
  const showUnit = (info: SceneInfo): void => {
    byId('unit-row').hidden = info.unit === null;
    if (!info.unit) return;
    const unit = select('unit'),
      metres = String(info.unit.metres),
      known = [...unit.options].find((o) => Number(o.value) === info.unit!.metres);
    if (!known) unit.append(new Option(`${metres} m`, metres));
    unit.value = known?.value ?? metres;
    setText('unit-note', info.unit.guessed ? 'guessed from their size' : '');
    if (info.unit.guessed && info.box) {
      const size = Math.max(...info.box.max.map((x, k) => x - info.box!.min[k]!));
      toast(
        `Taken as ${unit.selectedOptions[0]!.text}: ${size < 1 ? `${short(1000 * size)} mm` : `${short(size)} m`} long. The unit can be changed under Files.`,
      );
    }
  };
  const showScenes = bindScenes(app);
  button('claim').onclick = () => app.claim();
  /** Cards below the header make way for what stands there. */
  const showNotice = (): void => {
    document.documentElement.toggleAttribute(
      'data-notice',
      ['banner', 'loading', 'away'].some((id) => !byId(id).hidden),
    );
  };
  const lookForPieces = bindOutOfView(app, showNotice);
  let wasWatching = false;
  const showRole = (): void => {
    const b = button('claim'),
      live = app.connection === 'live';
    b.hidden = !live || app.readOnly || (app.roleNow.held && app.roleNow.clients < 2);
    b.textContent = app.roleNow.held ? 'Give the tools back' : 'Take the tools';
    b.title = `${b.textContent} (C)`;
    const pill = byId('connection');
    pill.dataset.state = app.connection;
    pill.textContent =
      app.connection === 'live'
        ? app.readOnly
          ? 'watching'
          : app.roleNow.held
            ? app.roleNow.clients > 1
              ? `tools, ${app.roleNow.clients} pages`
              : 'live'
            : 'watching'
        : app.connection;
    pill.toggleAttribute('data-plain', pill.textContent === 'live');
    pill.title =
      app.connection === 'refused'
        ? 'kerf view refuses this page'
        : app.connection !== 'live'
          ? 'No connection to the engine'
          : app.roleNow.held
            ? 'This page holds the tools'
            : app.readOnly
              ? 'A program leads this session'
              : 'Another page holds the tools';
    document.documentElement.toggleAttribute('data-watches', app.readOnly);
    const refused = app.connection === 'refused',
      lost = app.connection === 'lost' || (app.connection === 'connecting' && app.bodies > 0);
    byId('banner').hidden = !lost && !refused;
    showNotice();
    if (refused) {
      setText(
        'banner',
        app.bodies > 0
          ? 'kerf view was started anew, and this page has its former address. Open the address that it printed now. The page goes on trying.'
          : 'kerf view refuses this address. Open the whole address that it printed, with its token. The page goes on trying.',
      );
    } else if (lost) {
      setText(
        'banner',
        app.bodies > 0
          ? app.readOnly
            ? 'The connection is lost. The page connects again by itself.'
            : 'The connection is lost. Tools are paused; the page connects again by itself.'
          : 'No connection: kerf view has ended, or this is not the whole address that it printed (with its token). The page goes on trying.',
      );
    }
    for (const id of [
      'play',
      'step',
      'reset',
      'speed',
      'scene',
      'record',
      'young',
      'poisson',
      'density',
      'gravity',
      'fix-rim',
      'fix-none',
      'result-save',
      'result-again',
      'result-on',
      'open-files',
      'unit',
      'loading-stop',
    ])
      (byId(id) as HTMLButtonElement).disabled = !app.toolAllowed;
    const watching = live && !app.toolAllowed;
    if (watching !== wasWatching) showHint();
    wasWatching = watching;
    showShow();
    showPlay();
  };
  const showPlay = (): void => {
    setIcon(byId('transport').querySelector('#play-icon')!, app.playing ? 'pause' : 'play');
    setText('play-word', app.playing ? 'Pause' : 'Play');
    button('play').title = app.playing ? 'Pause (Space)' : 'Play (Space)';
    button('undo').disabled = !app.toolAllowed || app.undoDepth === 0;
    button('redo').disabled = !app.toolAllowed || app.redoDepth === 0;
    explanation.update();
    const near = kSpeeds.reduce((a, b) => (Math.abs(b - app.speed) < Math.abs(a - app.speed) ? b : a));
    if (document.activeElement !== select('speed')) select('speed').value = String(near);
  };

  const fullscreen = (): void => {
    if (document.fullscreenElement) void document.exitFullscreen();
    else document.documentElement.requestFullscreen().catch(() => toast('The browser refuses full screen.', true));
  };
  const nextTheme = (): void => {
    select('theme').value = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
    remembered.set('theme', select('theme').value);
    applyTheme();
  };
  const turn = (azimuth: number, polar: number, zoom: number): void => app.turn(azimuth, polar, zoom);

  // Keys and help
  const help = byId<HTMLDialogElement>('help');
  const shortcuts: Shortcut[] = [
    ...kTools.map((t) => ({
      keys: t.key,
      title: t.title,
      run: () => {
        if (usable(t.name)) chooseTool(t.name);
      },
    })),
    { keys: 'Space', title: 'Play or pause', run: () => app.play(!app.playing) },
    { keys: '.', title: 'One step', run: () => button('step').click() },
    { keys: '[', title: 'Slower', run: () => changeSpeed(-1) },
    { keys: ']', title: 'Faster', run: () => changeSpeed(1) },
    { keys: 'Z, Ctrl Z', title: 'Undo the last cut', run: () => command(CommandCode.Undo) },
    { keys: 'Shift Z, Y, Ctrl Y, Ctrl Shift Z', title: 'Redo', run: () => command(CommandCode.Redo) },
    { keys: 'R', title: 'Start again', run: () => app.reset() },
    { keys: '/', title: 'Scenes', run: () => button('scene').click() },
    { keys: ';', title: 'Show me, or my turn', run: () => button('show').click() },
    { keys: '<', title: 'Smaller instrument', run: () => changeSize(-0.08) },
    { keys: '>', title: 'Larger instrument', run: () => changeSize(0.08) },
    { keys: 'D', title: 'Finish the operation: the score', run: () => finish() },
    { keys: 'J', title: 'Open or close the jaws of a tool', run: () => app.lead.toggleJaws() },
    { keys: 'K', title: 'Contacts and forces', run: () => setContacts(!app.things.showContacts) },
    ...kViews.map((v) => ({ keys: v.key, title: v.title, run: () => setView(v.name, !app.overlays.shown[v.name]) })),
    { keys: 'Q', title: 'Arthroscope or free view', run: () => app.setScope(!app.stage.scopeOn) },
    { keys: 'Shift ArrowLeft', title: 'Turn the arthroscope about its shaft', run: () => app.turnScope(-10) },
    { keys: 'Shift ArrowRight', title: 'Turn the arthroscope about its shaft', run: () => app.turnScope(10) },
    { keys: 'G', title: 'Gravity on or off', run: toggleGravity },
    { keys: 'H', title: 'Look at the body', run: () => app.resetCamera() },
    { keys: 'ArrowLeft', title: 'Turn the view', run: () => turn(-8, 0, 1) },
    { keys: 'ArrowRight', title: 'Turn the view', run: () => turn(8, 0, 1) },
    { keys: 'ArrowUp', title: 'Look from higher', run: () => turn(0, 6, 1) },
    { keys: 'ArrowDown', title: 'Look from lower', run: () => turn(0, -6, 1) },
    { keys: '+, =', title: 'Nearer', run: () => turn(0, 0, 0.9) },
    { keys: '-', title: 'Farther', run: () => turn(0, 0, 1 / 0.9) },
    { keys: 'P', title: 'Save a picture', run: () => void savePicture() },
    { keys: ',', title: 'Explain this cut', run: () => explanation.toggle() },
    { keys: 'Shift R', title: 'Record', run: record },
    { keys: 'E', title: 'Export the meshes', run: () => command(CommandCode.Export, [], 'obj') },
    { keys: 'Shift W', title: 'Pieces by weight', run: toggleWeights },
    { keys: 'M', title: 'Settings, views and plots', run: () => showPanel(panel.hidden) },
    { keys: 'C', title: 'Take or give back the tools', run: () => app.claim() },
    { keys: 'T', title: 'Light or dark', run: nextTheme },
    { keys: 'F', title: 'Full screen', run: fullscreen },
    {
      keys: 'Escape',
      title: 'Cancel the stroke, close the panel',
      run: () => {
        if (app.strokeActive) app.hand.cancelStroke(true);
        else if (!explanation.close()) showPanel(false);
      },
    },
    { keys: '?', title: 'This help', run: () => help.showModal() },
  ];
  bindKeys(shortcuts);
  const shownKeys = shortcuts.filter((s) => !/^(Arrow(Left|Up|Down)|Shift ArrowLeft)/.test(s.keys));
  byId('keys').innerHTML = shownKeys
    .map((s) => {
      const keys =
        s.keys === 'ArrowRight'
          ? '← → ↑ ↓'
          : s.keys === 'Shift ArrowRight'
            ? 'Shift ← →'
            : s.keys.split(', ').slice(0, 2).join('</kbd> <kbd>');
      return `<div><dt>${s.title}</dt><dd><kbd>${keys}</kbd></dd></div>`;
    })
    .join('');
  byId('tool-words').innerHTML = kTools.map((t) => `<dt>${t.title}</dt><dd>${t.touch ?? t.hint}</dd>`).join('');
  button('help-open').onclick = () => help.showModal();

  // Plots
  let plots: { update(): void } | null = null;
  byId<HTMLDetailsElement>('plots-section').addEventListener('toggle', () => {
    if (plots || !byId<HTMLDetailsElement>('plots-section').open) return;
    void import('./plots')
      .then((m) => {
        plots = m.makePlots(app, byId('plots'));
        plots.update();
      })
      .catch(() => setText('plots', 'The plots could not be loaded.'));
  });

  // Readouts
  const whole = (x: number | undefined): string => (x === undefined ? '–' : x.toLocaleString('en'));
  app.listener = {
    overView,
    connection(_state: EngineState) {
      showRole();
    },
    scene(info: SceneInfo) {
      showScenes(info);
      document.title = `${info.title} · Kerf`;
      input('young').value = String(Math.log10(info.material.young));
      input('poisson').value = String(info.material.poisson);
      input('density').value = String(info.material.density);
      input('gravity').value = String(-info.gravity[2]);
      for (const id of ['young', 'poisson', 'density', 'gravity']) input(id).dispatchEvent(new Event('input'));
      showUnit(info);
      showRole();
      showHint();
    },
    loading(now: Loading | null) {
      byId('loading').hidden = now === null;
      showNotice();
      if (!now) return;
      setText('loading-text', now.stage ? `Loading: ${now.stage}` : 'Loading…');
      byId<HTMLProgressElement>('loading-bar').value = now.fraction;
    },
    progress() {
      setText('r-fps', app.drawing.fps >= 1 ? app.drawing.fps.toFixed(0) : app.drawing.fps > 0 ? '<1' : 'at rest');
      byId('r-fps-unit').hidden = app.drawing.fps === 0;
      showRecordingTime();
      lookForPieces();
      placeNotch(app);
      if (!panel.hidden) {
        for (const [row, of] of [
          ['l', 'cut'],
          ['m', 'motion'],
        ] as const) {
          const l = app.latency.summary(of);
          setText(`${row}-am`, short(l.appliedMedian));
          setText(`${row}-a9`, short(l.applied99));
          setText(`${row}-pm`, short(l.presentedMedian));
          setText(`${row}-p9`, short(l.presented99));
        }
        plots?.update();
      }
    },
    play: showPlay,
    role(_role: Role) {
      showRole();
    },
    stats(s: Stats) {
      setText('r-step', short(s.stepMs));
      setText('t-step', `${short(s.stepMs)}`);
      const felt = app.things.tools.map((t) => Math.hypot(...t.force));
      byId('contact-table').hidden = !app.things.any && app.things.touching === 0;
      setText('k-n', String(app.things.touching));
      setText('k-press', short(app.things.press));
      setText('k-tool', felt.length > 0 ? felt.map(short).join(', ') : '–');
      showPieces();
      showCounts();
    },
    cut(r: CutReport | null) {
      if (!r) {
        for (const id of ['r-cut', 't-binding', 't-embedding', 't-surface', 't-total']) setText(id, '–');
        return;
      }
      // A piece that is taken away is cut by nothing.
      if ((r.outcome === Outcome.Cut && r.trianglesCut > 0) || r.outcome === Outcome.Refused) {
        setText('r-cut', short(r.totalMs));
        setText('t-binding', short(r.bindingMs));
        setText('t-embedding', short(r.embeddingMs));
        setText('t-surface', short(r.surfaceMs));
        setText('t-total', short(r.totalMs));
      }
      if (r.text) toast(r.text, r.outcome === Outcome.Refused);
      else if (r.outcome === Outcome.NothingMet && r.input > 0 && app.toolAllowed)
        toast(toolInfo(app.tool).missed ?? kMissed);
      if (r.invariants === 1) toast('The engine reports a broken invariant after this cut.', true);
      showPieces();
      showCounts();
    },
    toast,
    file(name, bytes) {
      download(name, new Blob([bytes as Uint8Array<ArrayBuffer>]));
      toast(`Saved ${name}.`);
    },
    things(_tools: number) {
      showTool();
      showSize();
      showHint();
    },
    score: showScore,
    recording: showRecording,
    showing() {
      if (!app.showing && app.info?.script?.runs && app.time >= app.info.script.ends)
        toast(
          app.info.lesion
            ? 'That was the operation. Start again, and it is yours.'
            : 'Your turn. Start again makes the body whole.',
        );
      showShow();
      showHint();
    },
    views() {
      showLegend(app);
    },
    scope(on: boolean) {
      button('scope').setAttribute('aria-pressed', String(on));
      placeNotch(app);
      if (on && remembered.get('used-scope') === null) {
        remembered.set('used-scope', '1');
        toast(
          fingers.matches
            ? 'Arthroscope: two fingers lead it; apart they push it in.'
            : 'Arthroscope: right drag leads it, the wheel pushes it in, Shift-right drag or Shift with arrows turns it.',
          false,
        );
      }
    },
    used(tool) {
      if (remembered.get(`used-${tool}`) === null) remembered.set(`used-${tool}`, '1');
      sceneRead();
      hint(null);
    },
  };
  function showPieces(): void {
    setText('r-pieces', String(app.pieces));
    setText('r-pieces-word', app.pieces === 1 ? 'piece' : 'pieces');
  }
  function showCounts(): void {
    const c = app.counts;
    setText('c-vv', whole(c?.visualVertices));
    setText('c-vt', whole(c?.visualTriangles));
    setText('c-cv', whole(c?.collisionVertices));
    setText('c-ct', whole(c?.collisionTriangles));
    setText('c-n', whole(c?.nodes));
    setText('c-h', whole(c?.hexahedra));
  }
  // What has no room on a phone moves into the panel.
  const onChange = (query: string, place: (small: boolean) => void): void => {
    const media = matchMedia(query);
    media.addEventListener('change', () => place(media.matches));
    place(media.matches);
  };
  onChange('(max-width: 430px), (max-height: 520px) and (min-width: 560px)', (small) =>
    small ? byId('speed-place').append(byId('speed-field')) : button('step').after(byId('speed-field')),
  );
  onChange('(max-width: 720px), (max-height: 520px)', (small) =>
    (small ? byId('figures') : byId('transport')).after(byId('legend')),
  );
  chooseTool('scalpel');
  showRole();
  if (new URLSearchParams(location.search).has('panel')) showPanel(true);
}
