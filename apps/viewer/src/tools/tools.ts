// The tools a person chooses from, and how a drag with each becomes Tool messages.
import { Phase, ToolCode, type ToolSample } from '../engine/protocol';

export type ToolName =
  | 'scalpel'
  | 'closed'
  | 'line'
  | 'grasp'
  | 'fix'
  | 'release'
  | 'hand'
  | 'rigid'
  | 'punch'
  | 'scissors'
  | 'shaver'
  | 'suction'
  | 'take'
  | 'probe';
/** Of an instrument that has one: what it is called, in parts of the body's diagonal, and how many sizes beside the body it still works. */
export interface ToolSize {
  title: string;
  least: number;
  own: number;
  most: number;
  near: number;
}
export interface ToolInfo {
  name: ToolName;
  /** One word, for the button. */
  word: string;
  title: string;
  key: string;
  hint: string;
  /** For fingers, where keys and buttons of a mouse say nothing. */
  touch?: string;
  /** Said when it met nothing. */
  missed?: string;
  code: number | null;
  size?: ToolSize;
}

/** Said of a tool without words of its own that met nothing. */
export const kMissed = 'Nothing was cut: the drag met nothing of the body.';

export const kTools: ToolInfo[] = [
  {
    name: 'scalpel',
    word: 'Scalpel',
    title: 'Scalpel',
    key: '1',
    code: ToolCode.Scalpel,
    hint: 'Drag across the body: the cut follows the pointer. Start beside the rim to cut it through.',
    touch: 'Drag across the body to cut.',
  },
  {
    name: 'line',
    word: 'Straight',
    title: 'Straight cut',
    key: '2',
    code: ToolCode.Line,
    hint: 'Press at A, let go at B: a straight cut between them.',
  },
  {
    name: 'closed',
    word: 'Closed',
    title: 'Closed cut',
    key: '3',
    code: ToolCode.Scalpel,
    hint: 'Draw around a piece and let go: the outline closes and the piece comes out.',
  },
  {
    name: 'grasp',
    word: 'Grasp',
    title: 'Grasp and pull',
    key: '4',
    code: ToolCode.Grasp,
    hint: 'Drag to pull; what lies free is carried, and put down where you let go. Hold Shift then to leave it held.',
    touch: 'Drag to pull; what lies free is carried, and put down where you let go.',
  },
  {
    name: 'fix',
    word: 'Fix',
    title: 'Fix',
    key: '5',
    code: ToolCode.Fix,
    hint: 'Click or brush over places that shall not move.',
    touch: 'Touch or brush over places that shall not move.',
  },
  {
    name: 'release',
    word: 'Release',
    title: 'Release',
    key: '6',
    code: ToolCode.Release,
    hint: 'Click or brush over fixed or held places to let them go.',
    touch: 'Touch or brush over fixed or held places to let them go.',
  },
  {
    name: 'hand',
    word: 'View',
    title: 'Move the view',
    key: '7',
    code: null,
    hint: 'Drag to turn the view; two fingers or the wheel zoom, Shift-drag with the right button moves.',
    touch: 'Drag to turn the view; pinch to zoom.',
  },
  {
    name: 'rigid',
    word: 'Tool',
    title: 'Rigid tool',
    key: '8',
    code: null,
    hint: "Drag the scene's tool across the view; wheel, or Shift and up or down: nearer and farther. J opens and closes jaws.",
    touch: 'Drag the tool of the scene across the view.',
  },
  {
    name: 'punch',
    word: 'Punch',
    title: 'Punch',
    key: '9',
    code: ToolCode.Punch,
    hint: 'Click to bite a piece out, over the rim too; drag to bite on. Hold Shift to leave the pieces lying.',
    touch: 'Touch to bite a piece out, over the rim too; drag to bite on.',
    size: { title: 'Radius', least: 0.01, own: 0.035, most: 0.15, near: 1 },
  },
  {
    name: 'scissors',
    word: 'Scissors',
    title: 'Scissors',
    key: '0',
    code: ToolCode.Scissors,
    hint: 'Drag from the rim inwards: the blades close each time the pointer has gone their length.',
    size: { title: 'Blades', least: 0.01, own: 0.05, most: 0.25, near: 1 },
  },
  {
    name: 'shaver',
    word: 'Shaver',
    title: 'Shaver',
    key: 'V',
    missed: 'Nothing was smoothed: the shaver works on edges that were cut.',
    code: ToolCode.Shaver,
    hint: 'Brush over a cut edge: first its bumps go, then the edge moves back. Only cut edges are shaved.',
    size: { title: 'Radius', least: 0.005, own: 0.02, most: 0.08, near: 2 },
  },
  {
    name: 'suction',
    word: 'Suction',
    title: 'Suction',
    key: 'U',
    code: ToolCode.Suction,
    hint: 'Press on loose pieces to suck them off. What is attached, and the largest piece, stays.',
    size: { title: 'Radius', least: 0.01, own: 0.05, most: 0.2, near: 1 },
  },
  {
    name: 'take',
    word: 'Take',
    title: 'Take away',
    key: 'A',
    code: ToolCode.Take,
    hint: 'Take hold of a loose piece, drag and let go: it is gone. Undo brings it back.',
  },
  {
    name: 'probe',
    word: 'Probe',
    title: 'Probe',
    key: 'I',
    code: ToolCode.Probe,
    missed: 'Nothing is felt here: the probe comes down where the pointer is on the body.',
    hint: 'Press on the body to feel it: the probe of the scene follows the pointer. The force is among the numbers.',
    size: { title: 'Depth', least: 0.002, own: 0.02, most: 0.08, near: 0 },
  },
];

export const toolInfo = (name: ToolName): ToolInfo => kTools.find((t) => t.name === name)!;

export interface StrokeMessage {
  tool: number;
  phase: number;
  samples: ToolSample[];
}

/** Turns the samples of one drag into messages. */
export class Stroke {
  private readonly all: ToolSample[] = [];
  private sentDown = false;
  constructor(readonly tool: ToolName) {}

  private get code(): number {
    return toolInfo(this.tool).code ?? ToolCode.Scalpel;
  }
  /** Straight and closed cuts are sent when they are complete; until then they are only drawn. */
  get deferred(): boolean {
    return this.tool === 'line' || this.tool === 'closed';
  }

  down(sample: ToolSample): StrokeMessage[] {
    this.all.push(sample);
    if (this.deferred) return [];
    this.sentDown = true;
    return [{ tool: this.code, phase: Phase.Down, samples: [sample] }];
  }

  move(samples: ToolSample[]): StrokeMessage[] {
    if (samples.length === 0) return [];
    this.all.push(...samples);
    return this.deferred ? [] : [{ tool: this.code, phase: Phase.Move, samples }];
  }

  up(sample: ToolSample): StrokeMessage[] {
    const code = this.code;
    if (!this.deferred) return [{ tool: code, phase: Phase.Up, samples: [sample] }];
    this.all.push(sample);
    const first = this.all[0]!;
    if (this.tool === 'line') {
      return [
        { tool: code, phase: Phase.Down, samples: [first] },
        { tool: code, phase: Phase.Up, samples: [sample] },
      ];
    }
    if (this.all.length < 4) return [];
    return [
      { tool: code, phase: Phase.Down, samples: [first] },
      { tool: code, phase: Phase.Move, samples: this.all.slice(1) },
      { tool: code, phase: Phase.Up, samples: [{ ...first, time: sample.time }] },
    ];
  }

  cancel(): StrokeMessage[] {
    return this.sentDown ? [{ tool: this.code, phase: Phase.Cancel, samples: [] }] : [];
  }
}
