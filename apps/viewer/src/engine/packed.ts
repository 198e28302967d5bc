// Messages that the server has deflated: docs/protocol.md, "Packed".
import { kHeaderBytes, MessageType, ProtocolError } from './protocol';

const kFixedBytes = kHeaderBytes + 8;

/** Can this browser unpack? */
export function canUnpack(): boolean {
  try {
    return Boolean(new DecompressionStream('deflate-raw'));
  } catch {
    return false; // not there, or of another format only
  }
}

const isPacked = (message: ArrayBuffer): boolean =>
  message.byteLength >= kFixedBytes && new DataView(message).getUint16(0, true) === MessageType.Packed;

async function unpacked(message: ArrayBuffer): Promise<ArrayBuffer> {
  const view = new DataView(message),
    bytes = view.getUint32(kHeaderBytes, true),
    deflated = view.getUint32(kHeaderBytes + 4, true);
  if (view.getUint32(4, true) !== message.byteLength || kFixedBytes + ((deflated + 3) & ~3) !== message.byteLength)
    throw new ProtocolError(`${deflated} packed bytes in a message of ${message.byteLength}`);
  const packed = new Blob([new Uint8Array(message, kFixedBytes, deflated)]);
  let out: ArrayBuffer;
  try {
    out = await new Response(packed.stream().pipeThrough(new DecompressionStream('deflate-raw'))).arrayBuffer();
  } catch (e) {
    throw new ProtocolError(`a packed message does not unpack: ${String(e)}`);
  }
  if (out.byteLength !== bytes) throw new ProtocolError(`${out.byteLength} bytes were packed as ${bytes}`);
  return out;
}

/** Hands messages on in the order in which they came, packed ones unpacked. Those that come meanwhile wait. */
export class Unpacker {
  private readonly waiting: ArrayBuffer[] = [];
  private busy = false;

  constructor(
    private readonly hand: (message: ArrayBuffer) => void,
    private readonly bad: (error: ProtocolError) => void,
  ) {}

  take(message: ArrayBuffer): void {
    if (!this.busy && this.waiting.length === 0 && !isPacked(message)) return this.hand(message);
    this.waiting.push(message);
    if (!this.busy) void this.work();
  }

  private async work(): Promise<void> {
    this.busy = true;
    try {
      for (let m = this.waiting.shift(); m; m = this.waiting.shift()) {
        try {
          this.hand(isPacked(m) ? await unpacked(m) : m);
        } catch (e) {
          if (!(e instanceof ProtocolError)) throw e;
          this.bad(e);
        }
      }
    } finally {
      this.busy = false;
    }
  }
}
