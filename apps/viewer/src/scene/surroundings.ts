// What wet surfaces mirror and what lights the shade: a dome with a horizon, a window and a strip of light. Drawn by nothing else.
import { BackSide, Mesh, Scene, ShaderMaterial, SphereGeometry } from 'three';
import { kWindowSource } from './looks';

const kDome = /* glsl */ `
varying vec3 vDir;
${kWindowSource}
const vec3 kZenith = vec3(0.20, 0.21, 0.23);   // light from above; more washes wet red out to pink
const vec3 kHorizon = vec3(0.34, 0.33, 0.32);  // a bright band: rims that are seen along show it
const vec3 kTable = vec3(0.14, 0.11, 0.09);    // what the table throws back
const float kBright = 9.0;                     // of the window, in units of white: highlights of the coat
const float kStrip = 2.0;                      // of the strip on the other side: the far rim
void main() {
  vec3 d = normalize(vDir);
  float up = smoothstep(-0.03, 0.05, d.z);
  vec3 light = mix(kTable, mix(kHorizon, kZenith, smoothstep(0.0, 0.45, d.z)), up);
  float strip = smoothstep(0.10, 0.16, d.z) * (1.0 - smoothstep(0.26, 0.34, d.z)) * smoothstep(0.55, 0.75, dot(normalize(d.xy), normalize(vec2(0.8, 0.6))));
  gl_FragColor = vec4(light + kBright * kWindow(d) * step(0.0, d.z) + kStrip * strip, 1.0);
}`;

export function makeSurroundings(): Scene {
  const scene = new Scene();
  const material = new ShaderMaterial({
    side: BackSide,
    depthWrite: false,
    vertexShader:
      'varying vec3 vDir;\nvoid main() { vDir = position; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }',
    fragmentShader: kDome,
  });
  scene.add(new Mesh(new SphereGeometry(5, 48, 32), material));
  return scene;
}

export function disposeSurroundings(scene: Scene): void {
  scene.traverse((o) => {
    if (!(o instanceof Mesh)) return;
    (o.geometry as SphereGeometry).dispose();
    (o.material as ShaderMaterial).dispose();
  });
}
