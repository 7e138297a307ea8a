"""Makes the seeds of the target mcap, corpus/mcap, from those of the target recording: again where a message or a column is new.

    build/venv/bin/python tests/fuzz/mcap_seeds.py build/host/host_tools/tool/cli/fingertip

A seed is a byte of options (fuzz_recording.cpp) and a file: one and two not packed, packed_one as the tool writes it, no_chunks. Each must fit into
the longest input of the target (CMakeLists.txt).
"""

import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "formats"))

import corpus  # noqa: E402
import mcap.writer  # noqa: E402

UNPACKED = {"compression": mcap.writer.CompressionType.NONE, "repeat_schemas": False}
# name: byte of options, recording, how another writer writes it; None: as the tool did
SEEDS = {
    "one": (0x01, "one", UNPACKED),
    "two": (0x03, "two", UNPACKED),
    "packed_one": (0x00, "one", None),
    "no_chunks": (0x22, "two", {"use_chunking": False, "repeat_schemas": False}),
}


def main(argv):
    if len(argv) != 1 or argv[0].startswith("-"):
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, (options, recording, how) in SEEDS.items():
            text, bag = folder / "seed.csv", folder / "seed.mcap"
            text.write_bytes((HERE / "corpus/recording" / recording).read_bytes()[1:])
            subprocess.run([argv[0], "convert", text, bag, "--overwrite"], check=True)
            if how is not None:
                corpus.bag_of(folder / "other.mcap", corpus.messages_of(bag), **how)
                bag = folder / "other.mcap"
            (HERE / "corpus/mcap" / name).write_bytes(bytes([options]) + bag.read_bytes())


if __name__ == "__main__":
    main(sys.argv[1:])
