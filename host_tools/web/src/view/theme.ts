/** Light or dark: as the system has it, until somebody chooses. */
import { paletteOf, type Palette } from './palette';

const KEY = 'fingertip.theme';
const system = matchMedia('(prefers-color-scheme: dark)');
const listeners = new Set<(palette: Palette) => void>();

export type Theme = 'system' | 'light' | 'dark';

function read(): Palette {
  const chosen = document.documentElement.dataset['theme'];
  const dark = chosen ? chosen === 'dark' : system.matches;
  const style = getComputedStyle(document.documentElement);
  return paletteOf((name) => style.getPropertyValue(`--${name}`), dark);
}

let current: Palette | null = null;

export function palette(): Palette {
  current ??= read();
  return current;
}

export function onPalette(listener: (palette: Palette) => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

export function theme(): Theme {
  const chosen = document.documentElement.dataset['theme'];
  return chosen === 'light' || chosen === 'dark' ? chosen : 'system';
}

export function setTheme(theme: Theme): void {
  if (theme === 'system') {
    delete document.documentElement.dataset['theme'];
  } else {
    document.documentElement.dataset['theme'] = theme;
  }
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // A browser that keeps nothing: chosen until the page is closed.
  }
  changed();
}

/** What was chosen before. */
export function restoreTheme(): void {
  let kept: string | null = null;
  try {
    kept = localStorage.getItem(KEY);
  } catch {
    kept = null;
  }
  if (kept === 'light' || kept === 'dark') {
    setTheme(kept);
  }
}

function changed(): void {
  current = read();
  for (const listener of listeners) {
    listener(current);
  }
}

system.addEventListener('change', changed);
