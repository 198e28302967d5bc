// The README's first picture is one that scripts/readme_picture.mjs may have made.
import { readFileSync } from 'node:fs';
import { describe, expect, it } from 'vitest';

const read = (path: string): Buffer => readFileSync(new URL(`../../../${path}`, import.meta.url));

describe("the README's first picture", () => {
  const png = read('docs/steak.png');
  it('is as wide as its script makes it, has few colours and is small', () => {
    expect([png.readUInt32BE(16), png.readUInt32BE(20)]).toEqual([1200, 750]);
    expect(png[25]).toBe(3); // a palette
    expect(png.length).toBeLessThan(400_000);
  });
  it('stands first in the README, which says where it comes from', () => {
    const readme = read('README.md').toString();
    expect(/!\[([^\]]*)\]\(([^)]*)\)/.exec(readme)?.slice(1)).toEqual([
      'A steak on a board, cut in three and pulled apart, as the page of kerf view draws it',
      'docs/steak.png',
    ]);
    expect(readme).toContain('apps/viewer/scripts/readme_picture.mjs');
  });
});
