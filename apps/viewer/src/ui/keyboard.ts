// Keys: one table for the listener and for the help dialog.

export interface Shortcut {
  keys: string;
  title: string;
  run(): void;
}

/** 'Shift Z', 'Ctrl Z', '1', 'Space', '?' of an event. */
export function keyName(
  e: Pick<KeyboardEvent, 'key' | 'code' | 'shiftKey' | 'ctrlKey' | 'metaKey' | 'altKey'> & {
    getModifierState?(key: string): boolean;
  },
): string {
  // AltGr types a character on many keyboards, and some systems report it as Ctrl and Alt.
  const altGraph = e.getModifierState?.('AltGraph') ?? false;
  let key = e.key === ' ' ? 'Space' : e.key.length === 1 ? e.key.toUpperCase() : e.key;
  if (e.code.startsWith('Digit') && !e.shiftKey && !altGraph) key = e.code.slice(5);
  const letter = /^[A-Z]$/.test(key);
  return `${(e.ctrlKey || e.metaKey) && !altGraph ? 'Ctrl ' : ''}${e.altKey && !altGraph ? 'Alt ' : ''}${e.shiftKey && (letter || key.length > 1) ? 'Shift ' : ''}${key}`;
}

const kTyping = 'input:not([type=range]):not([type=checkbox]), textarea, [contenteditable]';

export function bindKeys(shortcuts: Shortcut[]): void {
  const table = new Map<string, () => void>();
  for (const s of shortcuts) for (const k of s.keys.split(', ')) table.set(k, () => s.run());
  window.addEventListener('keydown', (e) => {
    const at = e.target instanceof Element ? e.target : document.body;
    if (at.closest(kTyping) || document.querySelector('dialog[open]')) return;
    const name = keyName(e);
    // What a focused control needs stays with it.
    const control = at.closest('button, select, input, summary');
    if (
      control &&
      (name === 'Space' || name === 'Enter' || name.startsWith('Arrow') || (at.closest('select') && name.length === 1))
    )
      return;
    const run = table.get(name);
    if (!run) return;
    e.preventDefault();
    run();
  });
}
