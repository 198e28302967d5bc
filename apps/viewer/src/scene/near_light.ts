// Light falls with the square of the way, however short the way is.
import { ShaderChunk } from 'three';

// three.js stops at a tenth of a metre: within, a lamp is as bright everywhere.
const kOwn = 'max( pow( lightDistance, decayExponent ), 0.01 )';
const kShortest = '1e-8'; // m^2: a tenth of a millimetre; only keeps the number finite

/** For lamps within small bodies; false: its text is another one, and near lamps stay dim. */
export function installNearLight(): boolean {
  const chunk = ShaderChunk.lights_pars_begin;
  if (!chunk.includes(kOwn)) return chunk.includes(kShortest);
  ShaderChunk.lights_pars_begin = chunk.replaceAll(kOwn, kOwn.replace('0.01', kShortest));
  return true;
}
