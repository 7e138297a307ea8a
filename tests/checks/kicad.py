"""KiCad's judgement of circuit boards: prints for each .kicad_pcb what its rule check counts, and the pads that differ from those of KiCad's own
parts, which KiCad turns and flips: mirrored parts show in nothing else."""

import json
import pathlib
import sys

import pcbnew

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "boards/drawing"))
import fabricate  # noqa: E402

LIBRARY = pathlib.Path("/usr/share/kicad/footprints")


def pads_of(part):
    return sorted((pad.GetName(), pad.GetCenter().x, pad.GetCenter().y, *pad.GetSize()) for pad in part.Pads())


def lands_off(board):
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
            pairs = zip(pads_of(other), pads_of(ours), strict=True)
            off += sum(a[0] != b[0] or max(abs(x - y) for x, y in zip(a[1:], b[1:], strict=True)) > 1000 for a, b in pairs)  # nm
    return off


for path in sys.argv[1:]:
    board, figures = fabricate.judged(path, pathlib.Path(f"{path}.txt"))
    print(json.dumps(figures | {"lands_off": lands_off(board)}))
