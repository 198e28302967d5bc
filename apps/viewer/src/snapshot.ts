// What tests and scripts read of the page: its own account, and where things are in the window.
import type { App } from './app';
import { skinPoint } from './scene/skinning';

export function snapshot(app: App): Record<string, unknown> {
  const s = app.mesh.state,
    camera = app.stage.camera.position,
    target = app.stage.controls.target;
  return {
    connection: app.connection,
    scene: app.info?.name ?? null,
    version: s?.version ?? null,
    counts: app.counts,
    drawn: s ? { vertices: s.nv, skin: s.ns, wall: s.nw, copies: s.nc, nodes: s.nn } : null,
    pieces: app.pieces,
    cut: app.lastCut,
    cuts: app.records.cuts,
    stats: app.lastStats,
    latency: { ...app.latency.summary(), motion: app.latency.summary('motion'), last: app.latency.last },
    fps: app.drawing.fps,
    quality: app.drawing.quality,
    qualityMode: app.drawing.mode,
    role: app.roleNow,
    readOnly: app.readOnly,
    tool: app.tool,
    showing: app.showing,
    toolAllowed: app.toolAllowed,
    stroke: app.hand.stroke !== null,
    ink: app.ink.waiting,
    playing: app.playing,
    speed: app.speed,
    time: app.time,
    undoDepth: app.undoDepth,
    redoDepth: app.redoDepth,
    views: { ...app.overlays.shown },
    frames: app.frames,
    patches: app.patches,
    bodies: app.bodies,
    errors: app.errors,
    lastError: app.lastError,
    ready: app.drawing.ready && s !== null && app.bodyShown,
    software: app.stage.software,
    camera: { position: camera.toArray(), target: target.toArray() },
    outOfView: app.pieceView.count(),
    bounds: { center: app.mesh.bounds.center.toArray(), radius: app.mesh.bounds.radius },
    blade: app.blade.visible,
    bladeLevel: app.blade.level,
    bladeTip: app.blade.tip.toArray(),
    loading: app.loadingNow,
    things: app.things.list.map((t) => ({ name: t.name, shape: t.shape, tool: t.tool })),
    floor: app.stage.floorShown,
    scopeOn: app.stage.scopeOn,
    score: app.scoreNow,
    lesion: app.info?.lesion ?? null,
    instrument: app.instrumentSize(app.tool),
    rigid: app.things.tools,
    touching: app.things.touching,
    press: app.things.press,
    unit: app.info?.unit ?? null,
    fixed: app.mesh.fixed.length,
  };
}

/** Window position of a vertex of the drawn mesh that is nearest to a rest position. */
export function pickRest(app: App, x: number, y: number, z: number): [number, number] | null {
  const s = app.mesh.state;
  if (!s) return null;
  let best = -1,
    near = Infinity;
  for (let v = 0; v < s.nv; v++) {
    const d = Math.hypot(s.rest[3 * v]! - x, s.rest[3 * v + 1]! - y, s.rest[3 * v + 2]! - z);
    if (d < near) {
      near = d;
      best = v;
    }
  }
  if (best < 0) return null;
  const p = skinPoint(
    s,
    app.mesh.cells.pose,
    s.copy[best]!,
    s.rest[3 * best]!,
    s.rest[3 * best + 1]!,
    s.rest[3 * best + 2]!,
  );
  return pickPoint(app, ...p);
}
/** Window position of a point of space. */
export function pickPoint(app: App, x: number, y: number, z: number): [number, number] {
  app.stage.camera.updateMatrixWorld();
  const p = app.stage.project([x, y, z]),
    box = app.canvas.getBoundingClientRect();
  return [p[0] + box.left, p[1] + box.top];
}
