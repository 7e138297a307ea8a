// What to print for a pad, which includes this: openscad -D 'part="mould"' -o mould.stl boards/pads/3x5.scad
// Millimetres. Each part lies as it is printed. A circuit board has a base plate of its own: <board>/pcb/*-plate.scad.
part = "mould"; // plate, frame, mould, walls

function wider(size, mm) = [size[0] + 2 * mm, size[1] + 2 * mm];

// From z on.
module block(size, high, z = 0) translate([-size[0] / 2, -size[1] / 2, z]) cube([size[0], size[1], high]);
module openings(places, high, z) for (p = places) translate([p[0], p[1], 0]) block([p[2], p[3]], high, z);

// To be screwed down.
module plain(high) difference() {
  block(outside, high);
  for (p = screws) translate([p[0], p[1], -1]) cylinder(d = screw_mm, h = high + 2, $fn = 32);
}

// holes, pockets: [x, y, width, height]; the pockets from below.
module plate(holes = [for (s = sensors) [s[0], s[1], hole_mm, hole_mm]], pockets = [], deep_mm = 0) difference() {
  plain(plate_mm);
  openings(holes, plate_mm + 2, -1);
  openings(pockets, deep_mm + 1, -1);
}

// The lid is below.
module frame() difference() {
  plain(lid_mm + ring_mm);
  block(opening, lid_mm + 2, -1);
  block(wider(flange, play_mm), ring_mm + 1, lid_mm);
}

module mould() difference() {
  block(wider(flange, wall_mm), rubber_mm + wall_mm);
  block(skin, rubber_mm + 1, wall_mm);
  block(flange, flange_mm + 1, wall_mm + rubber_mm - flange_mm);
}

// To cast on.
module walls() difference() {
  plain(rubber_mm);
  block(skin, rubber_mm + 2, -1);
}

if (part == "plate") plate();
if (part == "frame") frame();
if (part == "mould") mould();
if (part == "walls") walls();
