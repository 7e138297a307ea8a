/** Dialogs: what the steps of the page have in common. */
import { MAIN, button, element, paragraph, wordsOf, write } from '../view/elements';

let dialogs = 0;

/** A dialog with a title, a message, an error, and a row of choices. */
export class Dialog {
  readonly element: HTMLDialogElement;
  readonly content = element('div');
  /** Spoken as it changes. */
  private readonly message = element('p', { role: 'status' });
  private readonly problem = element('p', { class: 'error', role: 'alert', hidden: true });
  private readonly choices = element('menu', { class: 'choices' });
  is_closed = false;
  onClose: () => void = () => undefined;

  constructor(title: string, ...content: (Node | string)[]) {
    const id = `step-${++dialogs}`;
    const heading = element('h2', { id }, title);
    this.element = element(
      'dialog',
      { class: 'step', 'aria-labelledby': id },
      heading,
      this.content,
      this.message,
      element('footer', {}, this.problem, this.choices),
    );
    this.element.addEventListener('close', () => {
      if (!this.element.open) {
        this.is_closed = true;
        this.element.remove();
        this.onClose();
      }
    });
    this.show(...content);
    document.body.append(this.element);
    this.choose();
    this.element.showModal();
  }

  /** Instead of what it has; a text becomes a paragraph. */
  show(...content: (Node | string)[]): void {
    this.content.replaceChildren(...content.map((each) => (typeof each === 'string' ? paragraph(each) : each)));
  }

  /** The buttons, before the one that closes. */
  choose(buttons: HTMLButtonElement[] = [], close = 'Cancel'): void {
    this.choices.replaceChildren(...[...buttons, button(close, () => this.close())].map((each) => element('li', {}, each)));
  }

  /** The button of an answer that takes time. */
  doing(label: string, work: () => Promise<void>, attributes = {}): HTMLButtonElement {
    return button(label, () => void this.run(work), attributes);
  }

  /** Asks whether what was found is to be stored in the fingertip; store throws where it was not. */
  offer(store: () => Promise<void>): void {
    this.setMessage('Store it in the fingertip?');
    const stored = async (): Promise<void> => {
      await store();
      this.setMessage('Stored: it applies from now on, and without power.');
      this.choose([], 'Close');
    };
    this.choose([this.doing('Store', stored, MAIN)]);
  }

  /** From now on the page can be used meanwhile, its pad above all. */
  beside(): void {
    this.element.close();
    this.element.classList.add('beside');
    this.element.show();
    document.querySelector('.pad-card.selected')?.scrollIntoView({ block: 'nearest' });
  }

  setMessage(text: string): void {
    write(this.message, text);
  }

  close(): void {
    this.element.close();
  }

  /** Runs what a button starts: the buttons rest meanwhile, and its error is shown. */
  async run(work: () => Promise<void>): Promise<void> {
    this.problem.hidden = true;
    const buttons = [...this.choices.querySelectorAll('button')].filter((each) => !each.disabled);
    buttons.forEach((each) => (each.disabled = true));
    try {
      await work();
    } catch (error) {
      this.problem.textContent = wordsOf(error);
      this.problem.hidden = false;
    } finally {
      buttons.forEach((each) => (each.disabled = false));
    }
  }
}

/** A labelled field with what it takes beside it. */
export function field(label: string, input: HTMLElement, hint = ''): HTMLElement {
  const id = `field-${++dialogs}`;
  input.id = id;
  const parts: HTMLElement[] = [element('label', { for: id }, label), input];
  if (hint) {
    input.setAttribute('aria-describedby', `${id}-hint`);
    parts.push(element('small', { id: `${id}-hint` }, hint));
  }
  return element('p', { class: 'field' }, ...parts);
}

/** A form whose Enter key presses the main button of its dialog, unless that rests. */
export function form(...content: HTMLElement[]): HTMLFormElement {
  const made = element('form', {}, ...content);
  made.addEventListener('submit', (event) => {
    event.preventDefault();
    made.closest('dialog')?.querySelector<HTMLButtonElement>('button.main')?.click();
  });
  return made;
}
