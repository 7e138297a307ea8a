"""KiCad's judgement of circuit boards: prints for each .kicad_pcb what its rule check counts, and the pads that lie elsewhere than those of KiCad's own
parts, which KiCad turns and flips: mirrored parts show in nothing else."""

import pathlib
import re
import sys

import pcbnew

LIBRARY = pathlib.Path("/usr/share/kicad/footprints")


def pads_off(board):
    off, scratch = 0, pcbnew.BOARD()  # flipping a part that is on no board crashes
    for ours in board.Footprints():
        library = LIBRARY / f"{ours.GetFPID().GetLibNickname()}.pretty"
        if library.is_dir():
            other = pcbnew.FootprintLoad(str(library), str(ours.GetFPID().GetLibItemName()))
            scratch.Add(other)
            other.SetPosition(ours.GetPosition())
            if ours.IsFlipped():
                other.Flip(ours.GetPosition(), True)
            other.SetOrientation(ours.GetOrientation())
            places = [sorted((pad.GetName(), pad.GetCenter().x, pad.GetCenter().y) for pad in part.Pads()) for part in (other, ours)]
            off += sum(max(abs(a[1] - b[1]), abs(a[2] - b[2])) > 1000 for a, b in zip(*places, strict=True))  # nm
    return off


for path in sys.argv[1:]:
    board = pcbnew.LoadBoard(path)
    pcbnew.ZONE_FILLER(board).Fill(board.Zones())
    pcbnew.WriteDRCReport(board, f"{path}.txt", pcbnew.EDA_UNITS_MILLIMETRES, True)
    counts = re.findall(r"\*\* Found (\d+)", pathlib.Path(f"{path}.txt").read_text(encoding="utf-8"))
    print(sum(map(int, counts)) + pads_off(board))
