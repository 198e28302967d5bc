// Keys: one table for the listener and for the help dialog.

export interface Shortcut { keys: string; title: string; run(): void }

/** 'Shift Z', 'Ctrl Z', '1', 'Space', '?' of an event. */
export function keyName(e: Pick<KeyboardEvent, 'key' | 'code' | 'shiftKey' | 'ctrlKey' | 'metaKey' | 'altKey'>): string {
  let key = e.key === ' ' ? 'Space' : e.key.length === 1 ? e.key.toUpperCase() : e.key;
  if (e.code.startsWith('Digit') && !e.shiftKey) key = e.code.slice(5);
  const letter = /^[A-Z]$/.test(key);
  return `${e.ctrlKey || e.metaKey ? 'Ctrl ' : ''}${e.altKey ? 'Alt ' : ''}${e.shiftKey && (letter || key.length > 1) ? 'Shift ' : ''}${key}`;
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
    if (control && (name === 'Space' || name === 'Enter' || name.startsWith('Arrow') || (at.closest('select') && name.length === 1))) return;
    const run = table.get(name);
    if (!run) return;
    e.preventDefault();
    run();
  });
}
