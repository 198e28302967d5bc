// Soft edges of shadows at a price that the CPU as a GPU can pay: one tap of a map that compares and blends by itself.
import { ShaderChunk, type Material } from 'three';

const kTaps = /* glsl */ `
#ifdef KERF_ONE_TAP
  // No noise: it would crawl on moving bodies, and nothing smooths it away.
  shadow = texture(shadowMap, shadowCoord.xyz);
  // The lit region is small, so that the map is fine and few fragments ask it: shadows fade towards its edge.
  const float kFade = 0.12; // of the region, at each side
  vec2 kEdge = min(shadowCoord.xy, 1.0 - shadowCoord.xy) / kFade;
  shadow = mix(1.0, shadow, clamp(min(kEdge.x, kEdge.y), 0.0, 1.0));
#else
`;

/** Puts the one tap beside those of three.js, whose text must be as it was when this was written; false: it is not. */
export function installOneTap(): boolean {
  const chunk = ShaderChunk.shadowmap_pars_fragment,
    start = chunk.indexOf('// Hardware PCF'),
    last = 'vogelDiskSample( 4, 5, phi ) * radius, shadowCoord.z ) )\n\t\t\t\t) * 0.2;';
  const end = chunk.indexOf(last);
  if (start < 0 || end < start || chunk.includes('KERF_ONE_TAP')) return chunk.includes('KERF_ONE_TAP');
  const stop = end + last.length;
  ShaderChunk.shadowmap_pars_fragment = `${chunk.slice(0, start)}${kTaps}${chunk.slice(start, stop)}\n#endif\n${chunk.slice(stop)}`;
  return true;
}

/** A material of lite. */
export function takeOneTap<M extends Material>(material: M): M {
  material.defines = { ...material.defines, KERF_ONE_TAP: '' };
  return material;
}
