// Own meshes: dropped or chosen, sorted into visual and collision, sent to the engine.
import type { App } from '../app';
import { CommandCode, UploadPart } from '../engine/protocol';
import { byId } from './dom';

interface NamedFile {
  name: string;
  size: number;
}

/** Indices of the visual and the collision mesh among files: by name, otherwise the larger one is visual; -1: none. */
export function sortMeshes(files: NamedFile[]): { visual: number; collision: number } {
  if (files.length === 0) return { visual: -1, collision: -1 };
  let collision = files.findIndex((f) => /coll|mid[-_ ]?surf|coarse/i.test(f.name));
  if (collision < 0 && files.length > 1) {
    collision = files.reduce((best, f, i) => (f.size < files[best]!.size ? i : best), 0);
  }
  if (files.length === 1) collision = -1;
  const visual = files.reduce(
    (best, f, i) => (i !== collision && (best < 0 || f.size > files[best]!.size) ? i : best),
    -1,
  );
  return { visual, collision };
}

const kMesh = /\.(obj|ply|stl|off)$/i,
  kWhole = /\.(toml|kerf)$/i;

/** Why these files can't be opened; null: they can be tried. */
export function whyNot(files: NamedFile[]): string | null {
  const large = files.find((f) => f.size > kLargestFile),
    other = files.find((f) => !kMesh.test(f.name) && !kWhole.test(f.name));
  if (large) return `${large.name} is larger than 512 MiB.`;
  if (!other) return null;
  return /\.kerfrec$/i.test(other.name)
    ? `${other.name} is a recording: kerf replay ${other.name} repeats it.`
    : `${other.name} can't be opened: meshes are OBJ, PLY, STL or OFF files; a scene (.toml) or a bound body (.kerf) will do too.`;
}

const kLargestFile = 512 * 1024 * 1024;

/** What the thickness field says, for the engine: a number, or one with %. Null: neither. */
export function readThickness(text: string): string | null {
  const found = /^\s*(\d*[.,]?\d+(?:e[+-]?\d+)?)\s*(%?)\s*$/i.exec(text);
  const number = Number(found?.[1]!.replace(',', '.'));
  return found && number > 0 && Number.isFinite(number) ? `${number}${found[2]}` : null;
}

const kGuess = '2 %'; // of a sheet's size

export function bindUpload(app: App, toast: (text: string, error?: boolean) => void): void {
  const chooser = byId<HTMLInputElement>('files'),
    dialog = byId<HTMLDialogElement>('upload');
  const visual = byId<HTMLSelectElement>('upload-visual'),
    collision = byId<HTMLSelectElement>('upload-collision');
  const thickness = byId<HTMLInputElement>('upload-thickness'),
    unit = byId<HTMLSelectElement>('upload-unit'),
    go = byId<HTMLButtonElement>('upload-go');
  const progress = byId<HTMLProgressElement>('upload-progress'),
    trouble = byId('upload-error'),
    drop = byId('drop');
  let files: File[] = [];

  const say = (text: string | null): void => {
    trouble.hidden = text === null;
    trouble.textContent = text ?? '';
  };
  const send = (parts: { part: number; file: File }[], thick: string, metres: number): void => {
    Promise.all(
      parts.map(async (p) => ({
        part: p.part,
        name: p.file.name,
        bytes: new Uint8Array(await p.file.arrayBuffer()),
      })),
    )
      .then((loaded) =>
        app.upload(loaded, thick, metres, (x) => {
          progress.value = x;
        }),
      )
      .catch((e: unknown) => {
        const text = e instanceof Error ? e.message : String(e);
        if (app.uploadWatch) app.uploadWatch.failed(text);
        else toast(text, true);
      });
  };

  /** The dialog is where this upload's trouble is told, whether it was open or not. */
  const watch = (): void => {
    app.uploadWatch = {
      under(stage, fraction) {
        progress.value = fraction;
        progress.setAttribute('aria-label', stage || 'Loading');
      },
      shown() {
        app.uploadWatch = null;
        if (dialog.open) dialog.close();
      },
      stopped() {
        this.shown();
      },
      failed(text) {
        app.uploadWatch = null;
        if (!dialog.open) ask();
        progress.hidden = true;
        go.disabled = !app.toolAllowed;
        say(text);
        if (!/is an open surface/.test(text)) return;
        if (thickness.value.trim() === '') thickness.value = kGuess;
        thickness.focus();
        thickness.select();
      },
    };
  };

  const open = (list: File[]): void => {
    if (list.length === 0) return;
    if (!app.toolAllowed) {
      toast('Take the tools first: another page holds them, or the connection is lost.', true);
      return;
    }
    const refused = whyNot(list);
    if (refused) {
      toast(refused, true);
      return;
    }
    app.uploadWatch = null;
    const other = list.find((f) => kWhole.test(f.name));
    if (other) {
      send([{ part: UploadPart.Scene, file: other }], '', 0);
      return;
    }
    files = list;
    if (files.length > 1) {
      ask();
      return;
    }
    // A closed mesh needs nothing else; an open one is asked for its thickness.
    toast(`Opening ${files[0]!.name}: its collision mesh is being made.`);
    thickness.value = '';
    unit.value = '0';
    watch();
    send([{ part: UploadPart.Visual, file: files[0]! }], '', 0);
  };

  const ask = (): void => {
    const sorted = sortMeshes(files);
    const options = (none: string | null): HTMLOptionElement[] => [
      ...(none ? [new Option(none, '-1')] : []),
      ...files.map((f, i) => new Option(f.name, String(i))),
    ];
    visual.replaceChildren(...options(null));
    collision.replaceChildren(...options('none: made from the visual mesh'));
    visual.value = String(sorted.visual);
    collision.value = String(sorted.collision);
    unit.value = '0';
    progress.hidden = true;
    go.disabled = false;
    say(null);
    dialog.showModal();
  };

  byId('upload-cancel').onclick = () => {
    dialog.dispatchEvent(new Event('cancel'));
    dialog.close();
  };
  byId<HTMLFormElement>('upload-form').onsubmit = (e) => {
    e.preventDefault();
    if (go.disabled) return;
    const v = files[Number(visual.value)],
      c = files[Number(collision.value)],
      thick = thickness.value.trim() === '' ? '' : readThickness(thickness.value);
    if (!v) return;
    if (thick === null) {
      say('The thickness is a number above 0, or a share of the size such as 2 %.');
      thickness.focus();
      return;
    }
    say(null);
    progress.value = 0;
    progress.hidden = false;
    go.disabled = true;
    watch();
    send(
      [
        { part: UploadPart.Visual as number, file: v },
        ...(c && c !== v ? [{ part: UploadPart.Collision as number, file: c }] : []),
      ],
      thick,
      Number(unit.value),
    );
  };
  // Cancelled while the engine reads and binds: what was shown stays.
  dialog.addEventListener('cancel', () => {
    if (!app.uploadWatch) return;
    app.uploadWatch = null;
    app.command(CommandCode.StopLoading);
  });

  byId('open-files').onclick = () => chooser.click();
  chooser.onchange = () => {
    open([...(chooser.files ?? [])]);
    chooser.value = '';
  };
  let depth = 0;
  const hasFiles = (e: DragEvent): boolean => e.dataTransfer?.types.includes('Files') ?? false;
  window.addEventListener('dragenter', (e) => {
    if (hasFiles(e)) {
      depth++;
      drop.hidden = false;
    }
  });
  window.addEventListener('dragleave', (e) => {
    if (hasFiles(e) && --depth <= 0) {
      depth = 0;
      drop.hidden = true;
    }
  });
  window.addEventListener('dragover', (e) => {
    if (hasFiles(e)) e.preventDefault();
  });
  window.addEventListener('drop', (e) => {
    depth = 0;
    drop.hidden = true;
    if (!hasFiles(e)) return;
    e.preventDefault();
    open([...(e.dataTransfer?.files ?? [])]);
  });
}
