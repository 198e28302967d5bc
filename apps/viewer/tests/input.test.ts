import { describe, expect, it } from 'vitest';
import { PointerMap, TwoFingers, type PointerKind } from '../src/tools/mapping';
import { FreshSamples, Pacer } from '../src/tools/pacing';
import { Stroke } from '../src/tools/tools';
import { Phase, ToolCode, type ToolSample } from '../src/engine/protocol';
import { keeps, keyName } from '../src/ui/keyboard';
import { readThickness, sortMeshes, whyNot } from '../src/ui/upload';
import { readSceneInfo } from '../src/scene_info';

const down = (id: number, kind: PointerKind, button = 0, alt = false) => ({ id, kind, button, alt });

describe('pointers', () => {
  it('gives the left button, pen and one finger to the tool, other buttons and Alt to the camera', () => {
    const m = new PointerMap();
    expect(m.down(down(1, 'mouse'))).toBe('tool');
    expect(m.owns(1)).toBe(true);
    expect(m.up(1)).toBe(true);
    expect(m.down(down(1, 'mouse', 2))).toBe('orbit');
    expect(m.up(1)).toBe(false);
    expect(m.down(down(1, 'mouse', 1))).toBe('orbit');
    expect(m.down(down(1, 'mouse', 0, true))).toBe('orbit');
    expect(m.down(down(2, 'touch'))).toBe('tool');
  });
  it('cancels the stroke when a second finger comes down', () => {
    const m = new PointerMap();
    expect(m.down(down(5, 'touch'))).toBe('tool');
    expect(m.down(down(6, 'touch'))).toBe('cancel-and-orbit');
    expect(m.active).toBeNull();
    expect(m.up(5)).toBe(false);
    expect(m.down(down(7, 'touch'))).toBe('orbit'); // finger 6 is still down
    m.up(6);
    m.up(7);
    expect(m.down(down(8, 'touch'))).toBe('tool');
  });
  it('lets fingers only move the camera once a pen was seen', () => {
    const m = new PointerMap();
    expect(m.down(down(1, 'pen'))).toBe('tool');
    m.up(1);
    expect(m.down(down(2, 'touch'))).toBe('orbit');
    m.up(2);
    expect(m.down(down(3, 'pen'))).toBe('tool');
  });
  it('never uses the tool while it is paused or with the hand tool', () => {
    const m = new PointerMap();
    m.toolAllowed = false;
    expect(m.down(down(1, 'mouse'))).toBe('orbit');
    m.toolAllowed = true;
    m.handTool = true;
    expect(m.down(down(1, 'mouse'))).toBe('orbit');
  });
  it('ignores other pointers during a stroke, and can be cancelled', () => {
    const m = new PointerMap();
    m.down(down(1, 'mouse'));
    expect(m.down(down(2, 'pen'))).toBe('orbit');
    expect(m.owns(2)).toBe(false);
    expect(m.cancel()).toBe(true);
    expect(m.cancel()).toBe(false);
  });
});

const sample = (time: number): ToolSample => ({ time, origin: [time, 0, 1], direction: [0, 0, -1], pressure: 0 });

describe('strokes', () => {
  it('sends the scalpel as it goes', () => {
    const s = new Stroke('scalpel');
    expect(s.down(sample(0))).toEqual([{ tool: ToolCode.Scalpel, phase: Phase.Down, samples: [sample(0)] }]);
    expect(s.move([sample(1), sample(2)])).toEqual([
      { tool: ToolCode.Scalpel, phase: Phase.Move, samples: [sample(1), sample(2)] },
    ]);
    expect(s.up(sample(3))).toEqual([{ tool: ToolCode.Scalpel, phase: Phase.Up, samples: [sample(3)] }]);
  });
  it('sends a straight cut as its two ends', () => {
    const s = new Stroke('line');
    expect(s.down(sample(0))).toEqual([]);
    expect(s.move([sample(1)])).toEqual([]);
    const m = s.up(sample(2));
    expect(m.map((x) => [x.tool, x.phase])).toEqual([
      [ToolCode.Line, Phase.Down],
      [ToolCode.Line, Phase.Up],
    ]);
    expect(m[0]!.samples[0]!.time).toBe(0);
    expect(m[1]!.samples[0]!.time).toBe(2);
  });
  it('closes a closed cut with its first ray', () => {
    const s = new Stroke('closed');
    s.down(sample(0));
    s.move([sample(1), sample(2), sample(3)]);
    const m = s.up(sample(4));
    expect(m.map((x) => x.phase)).toEqual([Phase.Down, Phase.Move, Phase.Up]);
    expect(m[2]!.samples[0]!.origin).toEqual(sample(0).origin);
    expect(m[2]!.samples[0]!.time).toBe(4);
  });
  it('does not cut with a mere click of the closed tool, and cancels only what was sent', () => {
    const s = new Stroke('closed');
    s.down(sample(0));
    expect(s.up(sample(1))).toEqual([]);
    const l = new Stroke('line');
    l.down(sample(0));
    expect(l.cancel()).toEqual([]);
    const c = new Stroke('scalpel');
    c.down(sample(0));
    expect(c.cancel()).toEqual([{ tool: ToolCode.Scalpel, phase: Phase.Cancel, samples: [] }]);
  });
});

describe('keys', () => {
  const press = (
    key: string,
    code: string,
    mods: Partial<Record<'shiftKey' | 'ctrlKey' | 'metaKey' | 'altKey', boolean>> = {},
  ): string => keyName({ key, code, shiftKey: false, ctrlKey: false, metaKey: false, altKey: false, ...mods });
  it('are named as in the table', () => {
    expect(press('z', 'KeyZ')).toBe('Z');
    expect(press('Z', 'KeyZ', { shiftKey: true })).toBe('Shift Z');
    expect(press('z', 'KeyZ', { metaKey: true })).toBe('Ctrl Z');
    expect(press('?', 'Minus', { shiftKey: true })).toBe('?');
    expect(press(' ', 'Space')).toBe('Space');
    expect(press('1', 'Digit1')).toBe('1');
    expect(press('&', 'Digit1')).toBe('1'); // where digits need Shift
    expect(
      keyName({
        key: '[',
        code: 'Digit8',
        shiftKey: false,
        ctrlKey: true,
        metaKey: false,
        altKey: true,
        getModifierState: () => true,
      }),
    ).toBe('[');
  });
});

describe('dropped meshes', () => {
  it('are told apart by name, then by size', () => {
    expect(
      sortMeshes([
        { name: 'knee-collision.obj', size: 10 },
        { name: 'knee.obj', size: 5 },
      ]),
    ).toEqual({ visual: 1, collision: 0 });
    expect(
      sortMeshes([
        { name: 'a.obj', size: 10 },
        { name: 'b.obj', size: 500 },
      ]),
    ).toEqual({ visual: 1, collision: 0 });
    expect(sortMeshes([{ name: 'a.obj', size: 10 }])).toEqual({ visual: 0, collision: -1 });
    expect(sortMeshes([{ name: 'collision.obj', size: 10 }])).toEqual({ visual: 0, collision: -1 });
    expect(sortMeshes([])).toEqual({ visual: -1, collision: -1 });
  });
  it('says at once what is no mesh', () => {
    const file = (name: string, size = 10): { name: string; size: number } => ({ name, size });
    expect(whyNot([file('a.OBJ'), file('b.stl')])).toBeNull();
    expect(whyNot([file('body.kerf')])).toBeNull();
    expect(whyNot([file('a.obj'), file('photo.png')])).toMatch(/photo\.png .*OBJ/);
    expect(whyNot([file('cut.kerfrec')])).toMatch(/kerf replay cut\.kerfrec/);
    expect(whyNot([file('a.obj', 1e9)])).toMatch(/larger/);
  });
});

describe('scene description', () => {
  it('takes what is there and replaces what is not', () => {
    const i = readSceneInfo({
      name: 'x',
      json: '{"scenes":[{"name":"x","title":"X"},{"name":3},null],"look":"meniscus","box":[0,0,0,1,1,1],"material":{"young":5},"gravity":[0,0,-1]}',
    });
    expect(i.scenes).toEqual([{ name: 'x', title: 'X', goal: '' }]);
    expect(i.look).toBe('meniscus');
    expect(i.box).toEqual({ min: [0, 0, 0], max: [1, 1, 1] });
    expect(i.material).toEqual({ young: 5, poisson: 0.45, density: 1000 });
    for (const json of [
      '',
      '{',
      '[]',
      'null',
      '7',
      '{"box":[1,2],"scenes":7,"material":null,"gravity":"x"}',
      '{"box":[1,0,0,0,0,0]}',
    ]) {
      const j = readSceneInfo({ name: 'y', json });
      expect(j.box).toBeNull();
      expect(j.look).toBe('steak');
      expect(j.gravity).toEqual([0, 0, -9.81]);
    }
  });
});

describe('pacing', () => {
  it('sends at once, then leaves a gap', () => {
    const p = new Pacer();
    expect(p.ready(0)).toBe(true);
    p.sent(1, 0);
    expect(p.ready(1)).toBe(false);
    expect(p.ready(5)).toBe(true);
  });
  it('waits for an engine that does not keep up, but not for ever', () => {
    const p = new Pacer();
    for (let t = 0; t < 30; t += 5) p.sent(1 + t, t);
    expect(p.ready(40)).toBe(false);
    p.answered(6); // the inputs 1 and 6
    expect(p.ready(39)).toBe(true);
    expect(p.ready(41)).toBe(false); // 11 was sent at 10
    expect(p.ready(290)).toBe(true);
    p.sent(100, 300);
    expect(p.ready(340)).toBe(false);
    p.forget();
    expect(p.ready(340)).toBe(true);
  });
});

describe('keys of a focused control', () => {
  it('stay with it where the keyboard led there', () => {
    for (const kind of ['button', 'select', 'other'] as const) {
      expect(keeps(kind, 'Space', false)).toBe(true);
      expect(keeps(kind, 'Enter', false)).toBe(true);
      expect(keeps(kind, 'P', false)).toBe(kind === 'select');
    }
  });
  it("are the page's where it was clicked, but for arrows", () => {
    for (const kind of ['button', 'select', 'other'] as const) {
      for (const key of ['Space', 'Enter', '4', '?']) expect(keeps(kind, key, true)).toBe(false);
      expect(keeps(kind, 'ArrowLeft', true)).toBe(kind !== 'button');
    }
  });
});

describe('a thickness', () => {
  it('is a number above 0 or a share', () => {
    expect(readThickness(' 2 ')).toBe('2');
    expect(readThickness('0,5')).toBe('0.5');
    expect(readThickness('1.5 %')).toBe('1.5%');
    expect(readThickness('2e-3')).toBe('0.002');
  });
  it('is nothing else', () => {
    for (const text of ['', '0', '-1', '%', 'thin', '1 mm', '1 2', '0 %', '1e999'])
      expect(readThickness(text)).toBeNull();
  });
});

describe('samples of a stroke', () => {
  const at = (...list: [number, number][]) => list.map(([timeStamp, clientX]) => ({ timeStamp, clientX, clientY: 5 }));
  const many = at([1, 10], [2, 11], [2, 12], [2, 12]);
  it('takes what comes raw and with a picture once, whichever comes first', () => {
    const f = new FreshSamples();
    f.begin();
    expect(f.of(many, true)).toEqual(many);
    expect(f.of([...many, ...at([3, 13])], false)).toEqual(at([3, 13]));
    expect(f.of(at([3, 13]), true)).toEqual([]);
    expect(f.of(at([3, 13]), true)).toHaveLength(1); // another at the same time and place
  });
  it('takes what comes with a picture where nothing comes raw', () => {
    const f = new FreshSamples();
    f.begin();
    f.of(many, false);
    f.begin();
    expect(f.of(many, false)).toEqual(many);
    expect(f.of(many, false)).toHaveLength(4);
  });
});

describe('two fingers', () => {
  it('come apart and move their middle; one or three do neither', () => {
    const f = new TwoFingers();
    f.down(1, 100, 0);
    expect(f.move(1, 110, 0)).toBeNull();
    f.down(2, 210, 0);
    expect(f.move(2, 230, 0)).toEqual({ apart: 20, x: 10, y: 0 });
    expect(f.move(1, 90, 0)).toEqual({ apart: 20, x: -10, y: 0 }); // a pinch: the middle is where it was
    expect(f.move(7, 0, 0)).toBeNull();
    f.down(3, 0, 0);
    expect(f.move(1, 80, 0)).toBeNull();
    f.up(3);
    f.up(2);
    expect(f.move(1, 70, 0)).toBeNull();
  });
});
