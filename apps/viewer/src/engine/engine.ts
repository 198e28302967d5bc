// What the page knows of an engine. A server over a WebSocket, a worker and the mock all do this.
import type {
  Body,
  CutReport,
  EngineError,
  FileMessage,
  Fixed,
  Frame,
  Hello,
  Hit,
  Loading,
  Masses,
  Overlay,
  Patch,
  Role,
  Score,
  Stats,
  Things,
  ToolSample,
  Vec3,
} from './protocol';

/** `refused`: the engine is there, and does not take this page. */
export type EngineState = 'connecting' | 'live' | 'lost' | 'refused';

/** Called with plain data and views that die with the call: copy what is kept. */
export interface EngineEvents {
  hello(hello: Hello): void;
  body(body: Body): void;
  patch(patch: Patch): void;
  frame(frame: Frame): void;
  hit(hit: Hit): void;
  stats(stats: Stats): void;
  cut(report: CutReport): void;
  role(role: Role): void;
  error(error: EngineError): void;
  overlay(overlay: Overlay): void;
  file(file: FileMessage): void;
  loading(loading: Loading): void;
  thingsCame(things: Things): void;
  score(score: Score): void;
  fixed(fixed: Fixed): void;
  masses(masses: Masses): void;
  state(state: EngineState): void;
}

/** `size`: metres, of the instrument; 0: one that fits the body. */
export interface ToolInput {
  tool: number;
  phase: number;
  modifiers: number;
  size?: number;
  samples: ToolSample[];
}
export interface Command {
  code: number;
  value?: readonly number[];
  text?: string;
}

/** Methods that return a number return that input's number, which messages that follow from it echo. */
export interface Engine {
  start(events: EngineEvents): void;
  stop(): void;
  /** The body and version that the page has: an engine that comes back need only send what changed since. */
  have(body: number, version: number): void;
  /** The page lost track: asks for the whole body again. */
  resync(): void;
  ack(seq: number): void;
  tool(input: ToolInput): number;
  /** What a view ray meets, or passes by at most `near` metres. */
  ray(origin: Vec3, direction: Vec3, near?: number): number;
  command(command: Command): number;
  claim(take: boolean): void;
  /** Leads a tool of the scene: position (metres), axis times angle (radians), jaws (1 open, 0 closed). */
  device(tool: number, position: Vec3, rotation: Vec3, jaws: number): number;
  /** Sends a file in chunks; resolves when the last chunk has been handed over. */
  upload(upload: number, part: number, name: string, bytes: Uint8Array): Promise<void>;
}
