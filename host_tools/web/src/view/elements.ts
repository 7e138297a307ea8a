/** Small makers of what the page is built of. */
type Child = Node | string;
type Attributes = Record<string, string | number | boolean | undefined>;

export function element<Name extends keyof HTMLElementTagNameMap>(
  name: Name,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[Name] {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === true) {
      made.setAttribute(key, '');
    } else if (value !== false && value !== undefined) {
      made.setAttribute(key, String(value));
    }
  }
  made.append(...children);
  return made;
}

export function button(label: string, press: () => void, attributes: Attributes = {}): HTMLButtonElement {
  const made = element('button', { type: 'button', ...attributes }, label);
  made.addEventListener('click', press);
  return made;
}

export function paragraph(text = ''): HTMLParagraphElement {
  return element('p', {}, text);
}

/** The button that is most likely wanted. */
export const MAIN = { class: 'main' };

/** The text of an error, for people. */
export function wordsOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** Writes only what differs: a text that is set again is laid out and read again. */
export function write(node: Node, text: string): void {
  if (node.textContent !== text) {
    node.textContent = text;
  }
}

let labels = 0;

/** A slider with its name and its value beside it. */
export function slider(
  name: string,
  unit: string,
  range: { least: number; most: number; step: number; value: number },
  input: (value: number) => void,
): { element: HTMLElement; value: number } {
  const id = `slider-${++labels}`;
  const field = element('input', {
    type: 'range',
    id,
    min: range.least,
    max: range.most,
    step: range.step,
    value: range.value,
  });
  const digits = range.step < 0.1 ? 2 : range.step < 1 ? 1 : 0;
  const output = element('output', { for: id });
  const show = () => {
    const text = `${Number(field.value).toFixed(digits)} ${unit}`.trim();
    write(output, text);
    field.setAttribute('aria-valuetext', text);
  };
  field.addEventListener('input', () => {
    show();
    input(Number(field.value));
  });
  show();
  return {
    element: element('div', { class: 'slider' }, element('label', { for: id }, name), field, output),
    get value() {
      return Number(field.value);
    },
    set value(value: number) {
      field.value = String(value);
      show();
    },
  };
}
