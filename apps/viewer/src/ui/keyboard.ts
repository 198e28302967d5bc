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

/**
 * Does a focused control need this key itself? Arrows always; what presses it or finds an entry by its letter only where the
 * keyboard led there, not where it was clicked.
 */
export function keeps(control: 'button' | 'select' | 'other', name: string, clicked: boolean): boolean {
  if (name.startsWith('Arrow')) return control !== 'button';
  if (clicked) return false;
  return name === 'Space' || name === 'Enter' || (control === 'select' && name.length === 1);
}

const kindOf = (e: Element): 'button' | 'select' | 'other' =>
  e instanceof HTMLButtonElement ? 'button' : e instanceof HTMLSelectElement ? 'select' : 'other';

export function bindKeys(shortcuts: Shortcut[]): void {
  const table = new Map<string, () => void>();
  for (const s of shortcuts) for (const k of s.keys.split(', ')) table.set(k, () => s.run());
  let clicked = false,
    spaceTaken = false;
  window.addEventListener('pointerdown', () => (clicked = true), { capture: true });
  window.addEventListener('keydown', (e) => (clicked &&= e.key !== 'Tab'), { capture: true });
  window.addEventListener('keydown', (e) => {
    const at = e.target instanceof Element ? e.target : document.body;
    if (e.defaultPrevented || at.closest(kTyping) || document.querySelector('dialog[open]')) return;
    const name = keyName(e);
    const control = at.closest('button, select, input, summary');
    if (control && keeps(kindOf(control), name, clicked)) return;
    const run = table.get(name);
    if (!run) return;
    e.preventDefault();
    spaceTaken = name === 'Space';
    run();
  });
  // Some browsers press a button when Space goes up.
  window.addEventListener('keyup', (e) => {
    if (e.key === ' ' && spaceTaken) e.preventDefault();
    spaceTaken &&= e.key !== ' ';
  });
}
