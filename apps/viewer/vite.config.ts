import { readFileSync } from 'node:fs';
import { defineConfig } from 'vitest/config';

/** The licences of what is built into the page, beside it. */
const licences = {
  name: 'licences',
  generateBundle(this: { emitFile(file: { type: 'asset'; fileName: string; source: string }): string }): void {
    const text = ['three', 'uplot']
      .map((p) => `${p}\n\n${readFileSync(`node_modules/${p}/LICENSE`, 'utf8').trim()}\n`)
      .join('\n---\n\n');
    this.emitFile({ type: 'asset', fileName: 'licenses.txt', source: text });
  },
};

// `kerf view` serves the built page; in development `npm run dev` forwards the socket to KERF_SERVER, which must be
// started with --origin http://localhost:5173.
// `vite build --mode single` puts all scripts into one, for a page in one file (scripts/share).
export default defineConfig(({ mode }) => ({
  base: './',
  plugins: [licences],
  build: {
    ...(mode === 'single' && {
      outDir: '../../build/page-single',
      emptyOutDir: true,
      rollupOptions: { output: { inlineDynamicImports: true } },
    }),
    target: 'es2022',
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
    modulePreload: { polyfill: false },
    sourcemap: false,
  },
  server: {
    proxy: { '/engine': { target: process.env.KERF_SERVER ?? 'http://127.0.0.1:8080', ws: true } },
  },
  // A busy machine is no failure.
  test: { include: ['tests/**/*.test.ts'], environment: 'node', testTimeout: 120_000 },
}));
