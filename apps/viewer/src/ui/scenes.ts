// The scenes that the engine offers: those with a goal as tiles with a picture, the others by their titles.
import type { App } from '../app';
import type { SceneInfo } from '../scene_info';
import { CommandCode } from '../engine/protocol';
import { byId, remembered, setText } from './dom';

const key = (app: App): string => `goal-${app.info?.name ?? ''}`;

/** What to try in the scene that is shown, until it was read. */
export function goalHint(app: App): string | null {
  const { name, opened, scenes } = app.info ?? { name: '', opened: true, scenes: [] };
  if (opened || remembered.get(key(app)) !== null) return null;
  return scenes.find((s) => s.name === name)?.goal || null;
}
export function goalRead(app: App): void {
  remembered.set(key(app), '1');
}

/** Returns what shows the scenes of a Hello. */
export function bindScenes(app: App): (info: SceneInfo) => void {
  const dialog = byId<HTMLDialogElement>('scenes'),
    button = byId<HTMLButtonElement>('scene');
  button.onclick = () => dialog.showModal();
  const choice = (name: string, ...parts: (Node | string)[]): HTMLButtonElement => {
    const b = document.createElement('button');
    b.type = 'button';
    b.dataset.scene = name;
    b.append(...parts);
    b.onclick = () => {
      dialog.close();
      app.command(CommandCode.Scene, [], name);
    };
    return b;
  };
  const text = (tag: string, words: string): HTMLElement => {
    const e = document.createElement(tag);
    e.textContent = words;
    return e;
  };
  let offered = '';
  return (info) => {
    setText('scene-title', info.title);
    button.title = `Scene: ${info.title}. Choose another (/)`;
    if (offered !== JSON.stringify(info.scenes)) {
      offered = JSON.stringify(info.scenes);
      const tile = (s: SceneInfo['scenes'][number]): HTMLElement => {
        const picture = document.createElement('img');
        picture.alt = '';
        picture.loading = 'lazy';
        picture.src = `./scenes/${encodeURIComponent(s.name)}.jpg`;
        return choice(s.name, picture, text('strong', s.title), text('span', s.goal));
      };
      byId('tiles').replaceChildren(...info.scenes.filter((s) => s.goal).map(tile));
      byId('more-scenes').replaceChildren(...info.scenes.filter((s) => !s.goal).map((s) => choice(s.name, s.title)));
    }
    for (const b of dialog.querySelectorAll<HTMLElement>('[data-scene]'))
      if (b.dataset.scene === info.name && !info.opened) b.setAttribute('aria-current', 'true');
      else b.removeAttribute('aria-current');
  };
}
