// The part that all engines share: input numbers, encoding, decoding and handing messages on.
import type { Command, Engine, EngineEvents, ToolInput } from './engine';
import {
  ProtocolError,
  decodeEngineMessage,
  encodePageMessage,
  kMaxToolSamples,
  kUploadChunkBytes,
  type PageMessage,
  type Vec3,
} from './protocol';

export abstract class MessageEngine implements Engine {
  protected events: EngineEvents | null = null;
  protected session = 0n;
  protected body = 0;
  protected version = 0;
  badMessages = 0;
  private nextInput = 1;

  abstract start(events: EngineEvents): void;
  abstract stop(): void;
  /** Hands bytes to the other side; false when there is no connection. */
  protected abstract post(bytes: ArrayBuffer): boolean;
  /** Resolves when the other side has taken most of what was posted. */
  protected drained(): Promise<void> {
    return Promise.resolve();
  }

  protected send(message: PageMessage): boolean {
    return this.post(encodePageMessage(message));
  }

  have(body: number, version: number): void {
    this.body = body;
    this.version = version;
  }
  abstract resync(): void;
  ack(seq: number): void {
    this.send({ type: 'ack', seq });
  }

  tool(input: ToolInput): number {
    let number = 0;
    for (let i = 0; i === 0 || i < input.samples.length; i += kMaxToolSamples) {
      number = this.nextInput++;
      // A stroke goes down once and up once, however many messages its samples need.
      const samples = input.samples.slice(i, i + kMaxToolSamples);
      const last = i + kMaxToolSamples >= input.samples.length;
      const phase = input.phase === 0 && i > 0 ? 1 : input.phase === 2 && !last ? 1 : input.phase;
      this.send({
        type: 'tool',
        input: number,
        tool: input.tool,
        phase,
        modifiers: input.modifiers,
        size: input.size ?? 0,
        samples,
      });
    }
    return number;
  }
  ray(origin: Vec3, direction: Vec3, near = 0): number {
    const input = this.nextInput++;
    this.send({ type: 'ray', input, near, origin, direction });
    return input;
  }
  command(command: Command): number {
    const input = this.nextInput++;
    const v = command.value ?? [];
    this.send({
      type: 'command',
      input,
      code: command.code,
      text: command.text ?? '',
      value: [v[0] ?? 0, v[1] ?? 0, v[2] ?? 0, v[3] ?? 0],
    });
    return input;
  }
  claim(take: boolean): void {
    this.send({ type: 'claim', take });
  }
  device(tool: number, position: Vec3, rotation: Vec3, jaws: number): number {
    const input = this.nextInput++;
    this.send({ type: 'device', input, tool, position, rotation, jaws });
    return input;
  }

  async upload(upload: number, part: number, name: string, bytes: Uint8Array): Promise<void> {
    for (let offset = 0; offset === 0 || offset < bytes.length; offset += kUploadChunkBytes) {
      const chunk = bytes.subarray(offset, offset + kUploadChunkBytes);
      if (!this.send({ type: 'upload', upload, part, name, offset, total: bytes.length, bytes: chunk })) {
        throw new Error('The connection was lost during the upload.');
      }
      await this.drained();
    }
  }

  /** Decodes what came from the engine; a bad message is counted and otherwise ignored. */
  protected receive(buffer: ArrayBuffer): void {
    const events = this.events;
    if (!events) return;
    try {
      const m = decodeEngineMessage(buffer);
      switch (m.type) {
        case 'hello':
          this.session = m.session;
          events.hello(m);
          break;
        case 'body':
          events.body(m);
          break;
        case 'patch':
          events.patch(m);
          break;
        case 'frame':
          events.frame(m);
          break;
        case 'hit':
          events.hit(m);
          break;
        case 'stats':
          events.stats(m);
          break;
        case 'cut':
          events.cut(m);
          break;
        case 'role':
          events.role(m);
          break;
        case 'error':
          events.error(m);
          break;
        case 'overlay':
          events.overlay(m);
          break;
        case 'file':
          events.file(m);
          break;
        case 'loading':
          events.loading(m);
          break;
        case 'things':
          events.thingsCame(m);
          break;
        case 'score':
          events.score(m);
          break;
        case 'fixed':
          events.fixed(m);
          break;
        case 'masses':
          events.masses(m);
          break;
      }
    } catch (e) {
      if (!(e instanceof ProtocolError)) throw e;
      this.countBad(e);
    }
  }
  protected countBad(error: ProtocolError): void {
    this.badMessages++;
    console.error(`kerf: bad message from the engine: ${error.message}`);
  }
}
