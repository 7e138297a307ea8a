/** Light or dark: as the system has it, until somebody chooses. */
import { paletteOf, type Palette } from './palette';

const KEY = 'fingertip.theme';
const system = matchMedia('(prefers-color-scheme: dark)');
let listener: (palette: Palette) => void = () => undefined;

export type Theme = 'system' | 'light' | 'dark';

function read(): Palette {
  const dark = theme() === 'system' ? system.matches : theme() === 'dark';
  const style = getComputedStyle(document.documentElement);
  return paletteOf((name) => style.getPropertyValue(`--${name}`), dark);
}

let current: Palette | null = null;

export function palette(): Palette {
  current ??= read();
  return current;
}

export function onPalette(listens: (palette: Palette) => void): void {
  listener = listens;
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
  try {
    const kept = localStorage.getItem(KEY);
    if (kept === 'light' || kept === 'dark') {
      setTheme(kept);
    }
  } catch {
    // A browser that keeps nothing.
  }
}

function changed(): void {
  current = read();
  listener(current);
}

system.addEventListener('change', changed);
