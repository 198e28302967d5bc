// Makes pictures for the docs small: at most 256 colours and, on request, narrower.
//   node scripts/shrink.mjs IN.png OUT.png [WIDTH]
import { readFileSync, writeFileSync } from 'node:fs';
import { withPage } from './page.mjs';
import { encodePng } from './palette_png.mjs';

/** The picture with few colours; `page`: any page of the browser, which decodes it. */
export async function shrink(page, png, wide = 0) {
  const pixels = await page.evaluate(
    async ([base64, width]) => {
      const image = await createImageBitmap(
        new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: 'image/png' }),
      );
      const f = width > 0 ? width / image.width : 1,
        w = Math.round(f * image.width),
        h = Math.round(f * image.height);
      const canvas = new OffscreenCanvas(w, h),
        g = canvas.getContext('2d');
      g.imageSmoothingQuality = 'high';
      g.drawImage(image, 0, 0, w, h);
      const { data } = g.getImageData(0, 0, w, h);
      let text = '';
      for (const b of data) text += String.fromCharCode(b);
      return { w, h, text: btoa(text) };
    },
    [png.toString('base64'), wide],
  );
  return encodePng(pixels.w, pixels.h, Buffer.from(pixels.text, 'base64'));
}

if (process.argv[1]?.endsWith('shrink.mjs')) {
  const [from, to, width] = process.argv.slice(2);
  await withPage({ url: 'about:blank' }, async (page) => {
    const small = await shrink(page, readFileSync(from), Number(width ?? 0));
    writeFileSync(to, small);
    console.log(`${to}: ${Math.round(small.length / 1000)} kB`);
  });
}
