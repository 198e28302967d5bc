/** The element with this id, which index.html has. */
export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const e = document.getElementById(id);
  if (!e) throw new Error(`index.html has no element ${id}`);
  return e as T;
}
export const setText = (id: string, text: string): void => {
  const e = byId(id);
  if (e.textContent !== text) e.textContent = text;
};
export const setIcon = (use: Element, name: string): void => use.setAttribute('href', `#i-${name}`);
/** Three significant digits at most, no exponent for everyday values. */
export function short(x: number): string {
  if (!Number.isFinite(x)) return '–';
  if (x === 0) return '0';
  return Math.abs(x) >= 100 ? x.toFixed(0) : Math.abs(x) >= 10 ? x.toFixed(1) : x.toFixed(2);
}
export function withUnit(x: number, unit: string): string {
  const steps: [number, string][] = [
    [1e9, 'G'],
    [1e6, 'M'],
    [1e3, 'k'],
    [1, ''],
  ];
  const [size, prefix] = steps.find(([s]) => Math.abs(x) >= s) ?? [1, ''];
  return `${short(x / size)} ${prefix}${unit}`;
}
/** Offers bytes as a download. */
export function download(name: string, content: Blob): void {
  const a = document.createElement('a');
  a.href = URL.createObjectURL(content);
  a.download = name;
  document.body.append(a);
  a.click();
  a.remove();
  setTimeout(() => URL.revokeObjectURL(a.href), 10000);
}
/** A remembered choice of this browser; storage may be refused. */
export const remembered = {
  get(key: string): string | null {
    try {
      return localStorage.getItem(`kerf.${key}`);
    } catch {
      return null;
    }
  },
  set(key: string, value: string): void {
    try {
      localStorage.setItem(`kerf.${key}`, value);
    } catch {
      /* not kept */
    }
  },
};
