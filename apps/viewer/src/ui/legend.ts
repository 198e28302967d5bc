// What the colours of the views mean, on the picture.
import { Color } from 'three';
import type { App } from '../app';
import { ContactWith } from '../engine/protocol';
import { kFootColours, kOverlayColours, type ViewName } from '../scene/overlays';
import { kContactColours } from '../scene/things';
import { byId } from './dom';

const drawn = (hex: number): string => `#${new Color(hex).getHexString()}`,
  linear = (c: [number, number, number]): string => `#${new Color(...c).getHexString()}`;

/** Of a view: CSS colour and words. An empty colour: as many as there are. */
const kLegend: Partial<Record<ViewName | 'contacts', [string, string][]>> = {
  wireframe: [[drawn(kOverlayColours.wireframe), 'edges of the visual mesh']],
  collision: [[drawn(kOverlayColours.collision), 'collision mesh']],
  hexahedra: [['', 'hexahedra, one colour a copy']],
  bound: [[drawn(kOverlayColours.bound), 'bound visual vertices and chains']],
  links: [[drawn(kOverlayColours.links), 'from collision to visual vertices']],
  feet: [
    [linear(kFootColours[0]!), 'bound to a collision vertex'],
    [linear(kFootColours[1]!), 'bound to a collision edge'],
    [linear(kFootColours[2]!), 'bound to a collision triangle'],
  ],
  contacts: [
    [linear(kContactColours[ContactWith.Obstacle]!), 'contact with an obstacle'],
    [linear(kContactColours[ContactWith.Tool]!), 'contact with a tool'],
    [linear(kContactColours[ContactWith.Body]!), 'contact with itself'],
  ],
};

/** Lines of the legend for what is shown. */
export function showLegend(app: App): void {
  const lines = Object.entries(kLegend).flatMap(([view, entries]) =>
    (view === 'contacts' ? app.things.showContacts : app.overlays.shown[view as ViewName]) ? entries : [],
  );
  const list = byId('legend');
  list.hidden = lines.length === 0;
  list.replaceChildren(
    ...lines.map(([colour, words]) => {
      const line = document.createElement('li'),
        swatch = document.createElement('i');
      if (colour) swatch.style.background = colour;
      line.append(swatch, words);
      return line;
    }),
  );
}
