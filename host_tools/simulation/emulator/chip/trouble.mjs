/** What goes wrong in a chip, by the faults in force (faults.mjs); it outlives a reset and a power cut. */
export class Trouble {
  constructor() {
    this.crystalDead = false;
    this.crystalWeak = false;
    this.pllLate = false;
    this.busyHub = false;
    this.lateResume = false;
  }
}
