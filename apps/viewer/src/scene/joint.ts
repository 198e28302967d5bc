// The inside of a joint around what an arthroscope sees: synovium, a wall of folds with vessels in it.
import { BackSide, Mesh, MeshLambertMaterial, SphereGeometry, type Data3DTexture, type Vector3 } from 'three';

const kWall = 1.15; // sizes of the body from its middle to the wall; nearer cuts the bones, farther sinks in the dark

// Folds bend the light, vessels run where they are thin and fat shows yellow between.
const kColour = /* glsl */ `
vec4 folds = texture(uNoise, 0.55 * vPlace + 0.2);
vec4 villi = texture(uNoise, 1.7 * vPlace + 0.6 + 0.05 * folds.rgb);
{
  float vessel = 1.0 - smoothstep(0.010, 0.045, abs(folds.r - 0.5 + 0.25 * (villi.g - 0.5)));
  float hair = 1.0 - smoothstep(0.010, 0.060, abs(villi.r - 0.5));
  vec3 c = mix(vec3(0.56, 0.25, 0.20), vec3(0.74, 0.52, 0.36), smoothstep(0.36, 0.66, folds.g));
  c *= 1.25 + 0.7 * villi.b;
  diffuseColor.rgb = mix(c, vec3(0.55, 0.05, 0.04), 0.55 * vessel + 0.28 * hair * smoothstep(0.4, 0.6, folds.b));
}`;
const kFolds = /* glsl */ `
#include <normal_fragment_begin>
normal = normalize(normal + 1.5 * (folds.gbr - 0.5) + 0.8 * (villi.gbr - 0.5));`;

export class Joint {
  readonly mesh: Mesh<SphereGeometry, MeshLambertMaterial>;

  constructor(noise: Data3DTexture) {
    const material = new MeshLambertMaterial({ side: BackSide });
    material.onBeforeCompile = (shader) => {
      shader.uniforms.uNoise = { value: noise };
      shader.vertexShader = shader.vertexShader
        .replace('#include <common>', '#include <common>\nvarying vec3 vPlace;')
        .replace('void main() {', 'void main() {\n\tvPlace = position;');
      shader.fragmentShader = shader.fragmentShader
        .replace('#include <common>', '#include <common>\nuniform highp sampler3D uNoise;\nvarying vec3 vPlace;')
        .replace('#include <color_fragment>', kColour)
        .replace('#include <normal_fragment_begin>', kFolds);
    };
    material.customProgramCacheKey = () => 'kerf-joint';
    this.mesh = new Mesh(new SphereGeometry(1, 48, 32), material);
    this.mesh.visible = false;
  }

  /** Around a body of this size, metres. */
  setBody(middle: Vector3, size: number): void {
    this.mesh.position.copy(middle);
    this.mesh.scale.setScalar(kWall * size);
  }
}
