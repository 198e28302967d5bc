// What is behind a scene without a floor: light around the middle, darker towards the corners; of an operation, the theatre.
import { CanvasTexture, Color, SRGBColorSpace, type Texture } from 'three';

const kPixels = 128;
const kMiddle = 1.3, // times the light of the colour
  kCorner = 0.5;

/** A picture of the whole window in shades of one colour. */
export function makeBackdrop(colour: number): Texture {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = kPixels;
  const g = canvas.getContext('2d')!,
    at = kPixels / 2;
  const shade = g.createRadialGradient(at, 0.9 * at, 0, at, 0.9 * at, 1.45 * at);
  const lit = (times: number): string => `#${new Color(colour).multiplyScalar(times).getHexString()}`;
  shade.addColorStop(0, lit(kMiddle));
  shade.addColorStop(0.45, lit(1));
  shade.addColorStop(1, lit(kCorner));
  g.fillStyle = shade;
  g.fillRect(0, 0, kPixels, kPixels);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}

const kTheatre = { wide: [256, 144], tall: [144, 312] } as const; // pixels: all in it is out of focus
/** Places and radii of the lamps over the table: of the width across, of a wide window's width down. */
const kLamps = [
  [0.63, 0.03, 0.05],
  [0.71, -0.02, 0.05],
  [0.7, 0.12, 0.05],
  [0.78, 0.06, 0.05],
  [0.24, 0.0, 0.035],
  [0.29, 0.05, 0.035],
] as const;
const kTallDown = 0.16; // by so much lower where the window is tall, as its header has two rows
const kFolds = 9; // of the drape, each a shade and a light beside it

const radial = (g: CanvasRenderingContext2D, x: number, y: number, r: number): CanvasGradient =>
  g.createRadialGradient(x, y, 0, x, y, r);

/** A dark room with lamps above, and under the body a drape in their light. `dim`: of the dark theme; `tall`: the window is. */
export function makeTheatre(dim: boolean, tall: boolean): Texture {
  const canvas = document.createElement('canvas'),
    [w, h] = tall ? kTheatre.tall : kTheatre.wide,
    unit = tall ? 0.75 * h : w;
  canvas.width = w;
  canvas.height = h;
  const g = canvas.getContext('2d')!;
  const paint = (fill: CanvasGradient, stops: [number, string][]): void => {
    for (const [at, colour] of stops) fill.addColorStop(at, colour);
    g.fillStyle = fill;
    g.fillRect(0, 0, w, Math.max(w, h)); // where it is squeezed its height is the width
  };
  paint(g.createLinearGradient(0, 0, 0, h), [
    [0, '#0b1214'],
    [0.3, '#142326'],
    [0.46, '#1f3c41'],
    [1, '#285259'],
  ]);
  // The drape falls in folds from the table's edge.
  for (let i = 0; i < kFolds; i++) {
    const x = (w * (i + 0.5 + 0.3 * Math.sin(2.4 * i))) / kFolds,
      lean = (x - 0.5 * w) * 0.35,
      wide = (0.45 * w) / kFolds;
    for (const [off, colour] of [
      [-0.5, 'rgba(6,22,25,0.22)'],
      [0.5, 'rgba(120,190,192,0.08)'],
    ] as const) {
      const at = x + off * wide,
        fold = g.createLinearGradient(at - wide, 0, at + wide, 0);
      for (const [stop, c] of [
        [0, 'rgba(0,0,0,0)'],
        [0.5, colour],
        [1, 'rgba(0,0,0,0)'],
      ] as const)
        fold.addColorStop(stop, c);
      g.save();
      g.transform(1, 0, lean / h, 1, -0.5 * lean, 0);
      g.fillStyle = fold;
      g.fillRect(at - wide, 0.42 * h, 2 * wide, h);
      g.restore();
    }
  }
  // The pool of light from above.
  g.save();
  g.scale(1, h / w);
  paint(g.createRadialGradient(0.5 * w, 0.58 * w, 0, 0.5 * w, 0.58 * w, 0.62 * w), [
    [0, 'rgba(150,205,205,0.50)'],
    [0.35, 'rgba(96,160,164,0.32)'],
    [1, 'rgba(20,40,44,0)'],
  ]);
  g.restore();
  paint(g.createLinearGradient(0, 0, 0, 0.5 * h), [
    [0, 'rgba(5,9,11,0.85)'],
    [1, 'rgba(5,9,11,0)'],
  ]);
  for (const [x, y, r] of kLamps)
    paint(radial(g, x * w, (y + (tall ? kTallDown : 0)) * unit, 1.9 * r * unit), [
      [0, 'rgba(255,250,238,0.50)'],
      [0.42, 'rgba(255,248,232,0.36)'],
      [0.55, 'rgba(226,236,236,0.10)'],
      [1, 'rgba(200,225,230,0)'],
    ]);
  if (dim) paint(g.createLinearGradient(0, 0, 0, h), [[0, 'rgba(0,0,0,0.45)']]);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}
