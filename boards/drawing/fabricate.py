#!/usr/bin/python3
"""What a board house wants of each circuit board, by KiCad's own plotter: Gerbers and drill files in one zip, list of parts, placement file, picture.

fabricate.py FOLDER    writes FOLDER/<name>/ for each fingertip-<name>.kicad_pcb, and prints what KiCad's rule check finds: it shall be nothing

Needs KiCad 6 (Debian: kicad, kicad-footprints). The same board gives the same bytes: dates and versions are left out.
"""

import json
import pathlib
import re
import shutil
import sys
import tempfile
import zipfile

import pcbnew

LAYERS = ("F_Cu", "B_Cu", "F_Mask", "B_Mask", "F_Paste", "B_Paste", "F_SilkS", "B_SilkS", "Edge_Cuts")
DATED = re.compile(r"^(\*\* (Created|Drc)|G04 Created|(%|; #@! )TF\.(Creation|Generation|ProjectId)|; DRILL).*\n", re.M)


def judged(path, report):
    """The board with its zones filled, and what KiCad's rule check counts. report: the file that its words go to."""
    board = pcbnew.LoadBoard(str(path))
    pcbnew.ZONE_FILLER(board).Fill(board.Zones())
    pcbnew.WriteDRCReport(board, str(report), pcbnew.EDA_UNITS_MILLIMETRES, True)
    text = DATED.sub("", report.read_text(encoding="utf-8"))
    report.write_text(text, encoding="utf-8")
    violations, unconnected, footprints = map(int, re.findall(r"\*\* Found (\d+)", text))
    return board, {"drc_violations": violations + footprints, "unconnected": unconnected}


def plotted(board, folder):
    """{name: text} of Gerbers and drill files. Their origin is the pad's middle."""
    plotter = pcbnew.PLOT_CONTROLLER(board)
    options = plotter.GetPlotOptions()
    options.SetOutputDirectory(str(folder))
    options.SetUseAuxOrigin(True)
    options.SetDrillMarksType(0)  # none: print would have them, too
    for layer in LAYERS:
        plotter.SetLayer(getattr(pcbnew, layer))
        plotter.OpenPlotfile(layer, pcbnew.PLOT_FORMAT_GERBER, layer)
        plotter.PlotLayer()
    plotter.ClosePlot()
    writer = pcbnew.EXCELLON_WRITER(board)
    writer.SetOptions(False, False, board.GetDesignSettings().GetAuxOrigin(), False)
    writer.SetFormat(True)  # metric; without it KiCad 6.0.11 writes hundredths
    writer.CreateDrillandMapFilesSet(str(folder), True, False)
    return {path.name: DATED.sub("", path.read_text(encoding="utf-8")) for path in sorted(pathlib.Path(folder).iterdir())}


def main(argv):
    if len(argv) != 1:
        sys.exit(__doc__)
    wrong = 0
    for path in sorted(pathlib.Path(__file__).resolve().parents[1].glob("*/pcb*/*.kicad_pcb")):
        folder = pathlib.Path(argv[0]) / path.stem.removeprefix("fingertip-")
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as scratch, zipfile.ZipFile(folder / f"{path.stem}-gerbers.zip", "w") as out:
            board, found = judged(path, folder / "rule-check.txt")
            for name, text in plotted(board, scratch).items():
                out.writestr(zipfile.ZipInfo(name), text)
        for file in (*path.parent.glob("*.csv"), *path.parent.glob("*.svg")):
            shutil.copy(file, folder)
        print(f"{folder}: {json.dumps(found)}")
        wrong += sum(found.values())
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
