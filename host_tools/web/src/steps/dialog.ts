/** Dialogs as plain DOM: what the steps of the page have in common. Their appearance: src/styles. */

type Attributes = Record<string, string | boolean>;

export function make<Name extends keyof HTMLElementTagNameMap>(
  name: Name,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[Name] {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== false) {
      made.setAttribute(key, value === true ? '' : value);
    }
  }
  made.append(...children);
  return made;
}

export function makeButton(label: string, press: () => void, main = false): HTMLButtonElement {
  const button = make('button', { type: 'button', class: main ? 'main' : '' }, label);
  button.addEventListener('click', press);
  return button;
}

/** The text of an error, for people. */
export function wordsOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

let dialogs = 0;

/** A dialog with a title, a message, an error, and a row of choices. */
export class Dialog {
  readonly element: HTMLDialogElement;
  readonly content = make('div');
  /** Spoken as it changes. */
  readonly message = make('p', { role: 'status' });
  private readonly problem = make('p', { class: 'error', role: 'alert', hidden: true });
  private readonly choices = make('menu', { class: 'choices' });
  private closed = false;

  /** onClose: once, however it was closed. */
  constructor(title: string, onClose: () => void = () => undefined) {
    const id = `step-${++dialogs}`;
    this.element = make(
      'dialog',
      { class: 'step', 'aria-labelledby': id },
      make('h2', { id }, title),
      this.content,
      this.message,
      this.problem,
      this.choices,
    );
    this.element.addEventListener('close', () => {
      this.closed = true;
      this.element.remove();
      onClose();
    });
    document.body.append(this.element);
    this.choose();
    this.element.showModal();
  }

  get is_closed(): boolean {
    return this.closed;
  }

  /** The buttons, before the one that closes. */
  choose(buttons: HTMLButtonElement[] = [], close = 'Cancel'): void {
    this.choices.replaceChildren(...[...buttons, makeButton(close, () => this.close())].map((button) => make('li', {}, button)));
  }

  setMessage(text: string): void {
    if (this.message.textContent !== text) {
      this.message.textContent = text;
    }
  }

  fail(error: unknown): void {
    this.problem.textContent = wordsOf(error);
    this.problem.hidden = false;
  }

  clearError(): void {
    this.problem.hidden = true;
    this.problem.textContent = '';
  }

  close(): void {
    this.element.close();
  }

  /** Runs what a button starts: the buttons rest meanwhile, and its error is shown. */
  async run(work: () => Promise<void>): Promise<void> {
    this.clearError();
    const buttons = [...this.choices.querySelectorAll('button')].filter((each) => !each.disabled);
    buttons.forEach((each) => (each.disabled = true));
    try {
      await work();
    } catch (error) {
      this.fail(error);
    } finally {
      buttons.forEach((each) => (each.disabled = false));
    }
  }
}

/** A labelled field with what it takes beside it. */
export function field(label: string, input: HTMLElement, hint = ''): HTMLElement {
  const id = `field-${++dialogs}`;
  input.id = id;
  const parts: HTMLElement[] = [make('label', { for: id }, label), input];
  if (hint) {
    input.setAttribute('aria-describedby', `${id}-hint`);
    parts.push(make('small', { id: `${id}-hint` }, hint));
  }
  return make('p', { class: 'field' }, ...parts);
}
