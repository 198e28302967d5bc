// Soft edges of shadows at a price that the CPU as a GPU can pay: one read of a map that compares and blends by itself. The five
// reads of three.js cost half a picture there.
import { ShaderChunk, type Material } from 'three';

const kOwn = /vec2 texelSize = [\s\S]*?\* 0\.2;/;
const kOneRead = /* glsl */ `
#ifdef KERF_ONE_READ
  shadow = texture(shadowMap, shadowCoord.xyz);
  // The lit region is small, so that the map is fine and few fragments ask it: shadows fade towards its edge.
  const float kFade = 0.12; // of the region, at each side
  vec2 edge = min(shadowCoord.xy, 1.0 - shadowCoord.xy) / kFade;
  shadow = mix(1.0, shadow, clamp(min(edge.x, edge.y), 0.0, 1.0));
#else
`;

/** Puts the one read beside those of three.js; false: its text is another one, and lite pays for all five. */
export function installSoftShadows(): boolean {
  const chunk = ShaderChunk.shadowmap_pars_fragment;
  if (chunk.includes('KERF_ONE_READ')) return true;
  const both = chunk.replace(kOwn, (own) => `${kOneRead}${own}\n#endif`);
  if (both === chunk) return false;
  ShaderChunk.shadowmap_pars_fragment = both;
  return true;
}

/** For materials of lite. */
export function readShadowOnce<M extends Material>(material: M): M {
  material.defines = { ...material.defines, KERF_ONE_READ: '' };
  return material;
}

const kOutwards = 'shadowWorldNormal * directionalLightShadows[ i ].shadowNormalBias';

/**
 * For what bodies lie on: it asks for its shadow from a little below its surface, not above, where it would be in the body and not
 * behind it. So the shadow begins where they touch, and no light is seen between. Not for what is round or thin: it would shade itself.
 */
export function shadowFromBelow<M extends Material>(material: M): M {
  const before = material.onBeforeCompile.bind(material),
    key = material.customProgramCacheKey.bind(material);
  material.onBeforeCompile = (shader, renderer) => {
    before(shader, renderer);
    shader.vertexShader = shader.vertexShader.replace(
      '#include <shadowmap_vertex>',
      ShaderChunk.shadowmap_vertex.replace(kOutwards, `- ${kOutwards}`),
    );
  };
  material.customProgramCacheKey = () => `${key()}-below`;
  return material;
}
