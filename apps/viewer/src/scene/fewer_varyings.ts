// What a CPU that draws carries from vertices to fragments costs memory for every triangle: what follows from the place in space is
// found there. three.js hands these over from vertices.
import { ShaderChunk } from 'three';

type Chunk = 'lights_phong_pars_fragment' | 'shadowmap_pars_fragment' | 'fog_pars_fragment';
const kLocal: readonly [Chunk, RegExp, string][] = [
  ['lights_phong_pars_fragment', /varying (vec3 vViewPosition;)/, '$1'],
  [
    'shadowmap_pars_fragment',
    /varying (vec4 vDirectionalShadowCoord\[)/,
    'uniform mat4 directionalShadowMatrix[ NUM_DIR_LIGHT_SHADOWS ];\n$1',
  ],
  ['fog_pars_fragment', /varying (float vFogDepth;)/, '$1'],
];

// As shadowmap_vertex and fog_vertex do.
const kFromPlace = /* glsl */ `
void main() {
  vViewPosition = -(viewMatrix * vec4(vInSpace, 1.0)).xyz;
#ifdef USE_FOG
  vFogDepth = vViewPosition.z;
#endif
#if defined(USE_SHADOWMAP) && NUM_DIR_LIGHT_SHADOWS > 0
  vec3 kAway = kInWorld(normalize(vNormal));
  #pragma unroll_loop_start
  for (int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++) {
    vDirectionalShadowCoord[ i ] = directionalShadowMatrix[ i ] * vec4(vInSpace + kAway * directionalLightShadows[ i ].shadowNormalBias, 1.0);
  }
  #pragma unroll_loop_end
#endif
`;

/** A fragment shader of MeshPhongMaterial that has vInSpace and kInWorld, with the rest of it found from there. */
export function withFewerVaryings(fragmentShader: string): string {
  let f = fragmentShader.replace('void main() {', kFromPlace);
  for (const [chunk, from, to] of kLocal) f = f.replace(`#include <${chunk}>`, ShaderChunk[chunk].replace(from, to));
  return f;
}
