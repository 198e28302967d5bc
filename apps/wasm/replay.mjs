// Repeats recordings with the engine as WebAssembly and says whether they end in the same bits:
//   node apps/wasm/replay.mjs build/wasm/kerf.wasm RECORDING...
// Exit status: 0 all the same, 1 one is not, 2 one can't be repeated.
import { readFileSync } from 'node:fs';
import { WASI } from 'node:wasi';

const [code, ...files] = process.argv.slice(2);
const compiled = await WebAssembly.compile(readFileSync(code));
let status = 0;
for (const file of files) {
  const wasi = new WASI({ version: 'preview1' });
  const instance = await WebAssembly.instantiate(compiled, wasi.getImportObject());
  wasi.initialize(instance);
  const k = instance.exports;
  const put = (bytes) => {
    const at = k.allocate(Math.max(1, bytes.length));
    new Uint8Array(k.memory.buffer, at, bytes.length).set(bytes);
    return [at, bytes.length];
  };
  const path = put(new TextEncoder().encode(file));
  k.put_file(...path, ...put(readFileSync(file)));
  const began = performance.now();
  const result = k.replay(...path);
  const said = new TextDecoder().decode(new Uint8Array(k.memory.buffer, k.text(), k.text_size()));
  console.log(`${file}: ${said} (${((performance.now() - began) / 1000).toFixed(1)} s)`);
  if (result === 1) status = 2;
  if (result === 2 && status === 0) status = 1;
}
process.exit(status);
