/** What may press on the simulated pad. */
export interface SimulatedObject {
  readonly name: string;
  readonly title: string;
  /** What it weighs when it is dropped. */
  readonly mass_g: number;
}

/** In the order of the file of objects (host_tools/web/tables/objects_of_twin.cpp). */
export const OBJECTS: readonly SimulatedObject[] = [
  { name: 'sphere15', title: 'weight on a ball of 15 mm', mass_g: 300 },
  { name: 'sphere6', title: 'ball of 6 mm', mass_g: 100 },
  { name: 'cube12', title: 'cube of 12 mm', mass_g: 100 },
  { name: 'cube24', title: 'plate of 24 mm', mass_g: 200 },
  { name: 'cylinder24', title: 'cylinder on its side, 24 mm', mass_g: 200 },
  { name: 'lime', title: 'lime', mass_g: 70 },
];
