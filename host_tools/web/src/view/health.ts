/** Line, bus, sensors, temperatures, losses, firmware: what is behind the numbers. */
import { element, write } from './elements';
import type { FactGroup } from './health_facts';

export class HealthPanel {
  readonly element: HTMLElement;
  private readonly groups = element('div', { class: 'fact-groups' });
  private shape = '';
  private values: HTMLElement[] = [];

  constructor() {
    this.element = element('details', { class: 'health', open: true }, element('summary', {}, 'Health'), this.groups);
  }

  show(groups: readonly FactGroup[]): void {
    const facts = groups.flatMap((group) => group.facts);
    const shape = groups.map((group) => `${group.title}:${group.facts.map((fact) => fact.name).join()}`).join(';');
    if (shape !== this.shape) {
      this.shape = shape;
      this.values = [];
      this.groups.replaceChildren(
        ...groups.map((group) =>
          element(
            'section',
            { class: 'facts' },
            element('h3', {}, group.title),
            element(
              'dl',
              {},
              ...group.facts.map((fact) => {
                const value = element('dd');
                this.values.push(value);
                return element('div', {}, element('dt', {}, fact.name), value);
              }),
            ),
          ),
        ),
      );
    }
    facts.forEach((fact, i) => {
      write(this.values[i], fact.value);
      this.values[i].className = fact.level;
    });
  }
}
