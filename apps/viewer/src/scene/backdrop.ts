// What is behind a scene without a floor: light around the middle, darker towards the corners.
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
