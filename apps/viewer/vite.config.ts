import { defineConfig } from 'vitest/config';

// `kerf view` serves the built page; in development `npm run dev` forwards the socket to KERF_SERVER, which must be
// started with --dev-origin http://localhost:5173.
export default defineConfig({
  base: './',
  build: {
    target: 'es2022',
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
    modulePreload: { polyfill: false },
    sourcemap: false,
  },
  server: {
    proxy: { '/engine': { target: process.env.KERF_SERVER ?? 'http://127.0.0.1:8080', ws: true } },
  },
  test: { include: ['tests/**/*.test.ts'], environment: 'node' },
});
