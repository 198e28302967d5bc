// The tools a person chooses from, and how a drag with each becomes Tool messages.
import { Phase, ToolCode, type ToolSample } from '../engine/protocol';

export type ToolName = 'scalpel' | 'closed' | 'line' | 'grasp' | 'fix' | 'release' | 'hand' | 'rigid';
export interface ToolInfo { name: ToolName; title: string; key: string; hint: string; code: number | null }

export const kTools: ToolInfo[] = [
  { name: 'scalpel', title: 'Scalpel', key: '1', code: ToolCode.Scalpel, hint: 'Drag across the body: the cut follows the pointer. Start beside the rim to cut it through.' },
  { name: 'line', title: 'Straight cut', key: '2', code: ToolCode.Line, hint: 'Press at A, let go at B: a straight cut between them.' },
  { name: 'closed', title: 'Closed cut', key: '3', code: ToolCode.Scalpel, hint: 'Draw around a piece and let go: the outline closes and the piece comes out.' },
  { name: 'grasp', title: 'Grasp and pull', key: '4', code: ToolCode.Grasp, hint: 'Drag to pull. Hold Shift when letting go to leave it held there.' },
  { name: 'fix', title: 'Fix', key: '5', code: ToolCode.Fix, hint: 'Click or brush over places that shall not move.' },
  { name: 'release', title: 'Release', key: '6', code: ToolCode.Release, hint: 'Click or brush over fixed or held places to let them go.' },
  { name: 'hand', title: 'Move the view', key: '7', code: null, hint: 'Drag to turn the view; two fingers or the wheel zoom, Shift-drag with the right button moves.' },
  { name: 'rigid', title: 'Rigid tool', key: '8', code: null, hint: 'Drag the scene\'s tool across the view; wheel, or Shift and up or down: nearer and farther. J opens and closes jaws.' },
];

export const toolInfo = (name: ToolName): ToolInfo => kTools.find((t) => t.name === name)!;

export interface StrokeMessage { tool: number; phase: number; samples: ToolSample[] }

/** Turns the samples of one drag into messages. */
export class Stroke {
  private readonly all: ToolSample[] = [];
  private sentDown = false;
  constructor(readonly tool: ToolName) {}

  private get code(): number { return toolInfo(this.tool).code ?? ToolCode.Scalpel; }
  /** Straight and closed cuts are sent when they are complete; until then they are only drawn. */
  get deferred(): boolean { return this.tool === 'line' || this.tool === 'closed'; }

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
      return [{ tool: code, phase: Phase.Down, samples: [first] }, { tool: code, phase: Phase.Up, samples: [sample] }];
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
