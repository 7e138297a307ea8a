/** Who works by keys stays where they were. A browser takes the focus from a control that is hidden, disabled or removed, and a
 * page that hides the button that was pressed would send its user back to the beginning. */

const CONTROLS = 'button, select, input, summary, a[href]';

function takesFocus(element: HTMLElement): boolean {
  return element.isConnected && element.checkVisibility({ visibilityProperty: true }) && !element.matches(':disabled');
}

/** The first control that takes the focus, in the nearest place that has one. */
function nearest(around: readonly HTMLElement[]): HTMLElement | undefined {
  for (const place of around) {
    if (place.isConnected && place.checkVisibility()) {
      const found = [place, ...place.querySelectorAll<HTMLElement>(CONTROLS)].find((each) => each.matches(CONTROLS) && takesFocus(each));
      if (found) {
        return found;
      }
    }
  }
  return undefined;
}

/** A control and the elements around it, from near to far; around a dialog are those that it was opened from. */
function placesAround(control: HTMLElement, before: readonly HTMLElement[]): HTMLElement[] {
  const places: HTMLElement[] = [];
  for (let place: HTMLElement | null = control; place; place = place.parentElement) {
    places.push(place);
    if (place instanceof HTMLDialogElement) {
      return [...places, ...before.filter((each) => !place.contains(each))];
    }
  }
  return places;
}

/** From now on; it checks before each picture whether the focus is lost. */
export function keepFocus(): void {
  let around: HTMLElement[] = []; // first of all the control that has the focus
  let resting = false; // it is disabled for a while
  document.addEventListener('focusin', ({ target }) => {
    if (target instanceof HTMLElement) {
      resting = false;
      around = placesAround(target, around);
    }
  });
  const look = (): void => {
    requestAnimationFrame(look);
    const [control] = around;
    if (!control || (document.activeElement ?? document.body) !== document.body) {
      return;
    }
    if (control.isConnected && control.matches(':disabled')) {
      resting = true;
    } else if (resting || !takesFocus(control)) {
      resting = false;
      nearest(around)?.focus();
    } else {
      around = []; // its user left it
    }
  };
  look();
}
