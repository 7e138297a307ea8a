"""The sensors' places, as the firmware has them (firmware/config/geometry.c)."""

import json
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE_mm = 3.3  # of an MS5840, each way (De Clercq et al., RA-L 2022, section III.A)
PACKAGE_HIGH_mm = 1.7  # there
PRINT = """
#include "config/geometry.h"
#include <stdio.h>
int main(void) {
  printf("[");
  for (int k = 0; k < geometry.sensor_count; k++)
    printf("%s[%.9g, %.9g]", k ? ", " : "", (double)geometry.x_mm[k], (double)geometry.y_mm[k]);
  printf("]");
}
"""


def places(root=ROOT):
    """[[x_mm, y_mm]] of the sensors."""
    with tempfile.TemporaryDirectory() as folder:
        source, program = pathlib.Path(folder, "print.c"), pathlib.Path(folder, "print")
        source.write_text(PRINT)
        subprocess.run(["gcc", f"-I{root / 'firmware'}", source, root / "firmware/config/geometry.c", "-o", program], check=True)
        return json.loads(subprocess.run([program], check=True, stdout=subprocess.PIPE).stdout)
