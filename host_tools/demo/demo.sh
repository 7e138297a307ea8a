#!/bin/sh
# Plays ten seconds of presses and slips to the emulated fingertip and draws what it felt.
# Everything goes to build/demo; run by `sh cmake/bootstrap.sh demo`.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
cd "$root"
out=build/demo
python=/usr/bin/python3
rm -rf $out
mkdir -p $out

fail() {
  tail -n 20 $out/emulator.log >&2
  echo "demo: $1; the emulator's whole log is $out/emulator.log" >&2
  exit 1
}

$python host_tools/python/scenario.py demo -o $out/scenario.csv

node host_tools/emulator/main.mjs --board pico_mux --image build/pico_mux/fingertip-pico_mux.bin \
  --scenario $out/scenario.csv --pty $out/fingertip.tty --wait-open --report $out/run.json \
  > $out/emulator.log 2>&1 &
emulator=$!
trap 'kill $emulator 2> /dev/null || true' EXIT
while [ ! -e $out/fingertip.tty ]; do
  kill -0 $emulator 2> /dev/null || fail "the emulator did not start"
  sleep 0.1
done

build/host/host_tools/cli/fingertip monitor --port $out/fingertip.tty --until-gone --record $out/recording.csv ||
  fail "the monitor ended with an error"
wait $emulator || fail "the emulator found something wrong"
trap - EXIT

$python host_tools/python/evaluate.py $out/recording.csv $out/scenario.csv --run $out/run.json -o $out/summary.json
$python host_tools/python/plot.py $out/recording.csv --truth $out/scenario.csv --run $out/run.json -o $out/demo.png
cat $out/summary.json
echo "picture: $out/demo.png"
