#!/bin/sh
# A fingertip is calibrated with twenty placements of a weight. Then a lime is gripped and slips, three times, on two emulated
# fingertips of the same rubber side by side: that one, and one that was never calibrated. Prints how far each was off, and
# draws both. Then a gripper with two fingertips lifts an object in the simulated cell: a grasp of kind usual. Prints what
# became of it, and draws it.
# Everything goes to build/demo; run by `sh cmake/bootstrap.sh demo`.
# usage: demo.sh [--stay]; --stay: goes on with the lime until Enter, to look at it
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
cd "$root"
out=build/demo
python=/usr/bin/python3
tool=build/host/host_tools/tool/cli/fingertip
simulation=build/host/host_tools/simulation
board=$($python host_tools/report/shared/boards.py | sed -n 1p) # the fastest
seconds=14 # three slips: at 20, 50 and 100 mm/s
rubber=000000000000B0BB
raw=000000000000BA5E # the same rubber, never calibrated
pad="--layer 12 --effects gain=5,relaxation,memory,aftereffect --seed 3"
weight_N=3
grasp_seed=2022 # was chosen before its grasp was seen, and chose nothing
rm -rf $out
mkdir -p $out

fail() {
  for name in calibrating rubber raw cell; do
    [ ! -s $out/$name.log ] || tail -n 10 $out/$name.log >&2
  done
  echo "demo: $1; whole logs are $out/*.log" >&2
  exit 1
}

# NAME SERIAL SCENARIO SECONDS [OPTION...]: its process is $!
emulate() {
  name=$1 serial=$2 scenario=$3 length=$4
  shift 4
  node host_tools/simulation/emulator/main.mjs --board "$board" --image "build/$board/fingertip-$board.bin" \
    --serial "$serial" --scenario "$scenario" --seconds "$length" --pty $out/$name.tty --wait-open --wait-reader "$@" > $out/$name.log 2>&1 &
}

# NAME PROCESS
wait_for_port() {
  while [ ! -e $out/$1.tty ]; do
    kill -0 "$2" 2> /dev/null || fail "the emulator did not start"
    sleep 0.1
  done
}

# NAME: a chip that is emulated beside much else boots for many seconds
wait_for_answer() {
  for _ in 1 2 3 4 5 6 7 8 9 10; do
    $tool info --port $out/$1.tty > /dev/null 2>&1 && return
  done
  fail "the emulated fingertip does not answer; try again when this machine has less to do"
}

# FILE KIND OPTION...: the scenario of the pad
play() {
  file=$1
  shift
  # shellcheck disable=SC2086
  $simulation/twin/twin scenario "$@" $pad --cache build/host/contact_tables -o "$file" > $out/twin.log 2>&1 ||
    { cat $out/twin.log >&2; fail "the pad could not be computed"; }
}
play_lime() { play $2 slip --indenter lime --seconds $1; }
play_lime $seconds $out/lime.csv

processes=
trap 'kill $processes 2> /dev/null || true' EXIT
echo "== a weight of $weight_N N is set down at twenty places, in simulated time; what a calibration finds of it"
play $out/placements.csv placements --force $weight_N --seconds 80
$simulation/player/fingertip_player play $out/placements.csv -o $out/placed.csv --raw --rate 50 --serial $rubber --quiet > $out/player.log 2>&1 ||
  { cat $out/player.log >&2; fail "the placements could not be played"; }
emulate calibrating $rubber $out/placements.csv 600 --flash $out/flash.bin
processes=$!
wait_for_port calibrating $processes
wait_for_answer calibrating
$tool calibrate --port $out/calibrating.tty --from $out/placed.csv --force $weight_N --yes > $out/calibration.txt 2>&1 ||
  { cat $out/calibration.txt >&2; fail "the calibration failed"; }
sed -n '/^good/p; /^of the placements/,$p' $out/calibration.txt
kill -INT $processes 2> /dev/null || true # and keeps its flash
wait $processes || [ $? -eq 130 ] || fail "the emulator found something wrong" # 130: interrupted while it ended
processes=

emulate rubber $rubber $out/lime.csv $seconds --flash $out/flash.bin --report $out/rubber.json
rubber_process=$!
processes=$rubber_process
emulate raw $raw $out/lime.csv 600 --report $out/raw.json --seed 2
raw_process=$!
processes="$rubber_process $raw_process"
wait_for_port rubber $rubber_process
wait_for_port raw $raw_process

echo "== a lime slips on two fingertips of the same rubber, at full rate: $rubber was calibrated, $raw never"
for name in rubber raw; do
  wait_for_answer $name
  $tool set --port $out/$name.tty osr=256 rate=max > /dev/null || fail "the fingertip cannot be set"
done
watch() {
  FINGERTIP_PORT=$out/rubber.tty:$out/raw.tty $tool monitor --device $rubber --device $raw --until-gone --record $out/recording.csv ||
    fail "the monitor ended with an error"
}
if [ -t 1 ]; then watch; else watch > $out/monitor.txt; fi # where no screen can be drawn, a line each second
wait $rubber_process || fail "the emulator found something wrong"
kill -INT $raw_process 2> /dev/null || true # however far it came: it ends with the other
wait $raw_process || [ $? -eq 130 ] || fail "the emulator found something wrong"
processes=

for name in rubber raw; do
  [ $name = rubber ] && serial=$rubber || serial=$raw
  $python host_tools/python evaluate $out/recording.csv $out/lime.csv --device "$serial" --run $out/$name.json -o $out/$name.summary.json
done
$python host_tools/python plot $out/recording.csv --device $rubber --truth $out/lime.csv --run $out/rubber.json --beside $raw --beside-name "never calibrated" \
  --beside-run $out/raw.json \
  -o $out/demo.png
$python host_tools/demo/errors.py "never calibrated=$out/raw.summary.json" "calibrated=$out/rubber.summary.json"
echo "The rubber's sensors differ by 5 %, it relaxes and remembers, and a lime's pressure is no Gaussian."
echo "picture: $out/demo.png"

echo "== two fingertips on a gripper lift an object: a grasp of kind usual; the firmware on the host, all else simulated"
$tool simulate --lift --ports $out/cell --gripper 2f85 --kind usual --seed $grasp_seed --seconds 60 --patience 1 \
  --cache build/host/contact_tables --truth $out/truth.csv < /dev/null > $out/cell.log 2>&1 &
processes=$!
while [ ! -e $out/cell/gripper ]; do
  kill -0 $processes 2> /dev/null || fail "the cell did not start"
  sleep 0.1
done
FINGERTIP_PORT=$out/cell/left:$out/cell/right $tool grasp --gripper 2f85 --gripper-port $out/cell/gripper --seconds 8 -o $out/grasp.csv ||
  fail "the grasp ended with an error"
kill $processes
wait $processes || fail "the cell found something wrong"
processes=
$python host_tools/demo/grasp.py $out/grasp.csv $out/truth.csv -o $out/grasp.png
echo "picture: $out/grasp.png"

if [ "${1:-}" != --stay ]; then
  echo "once more: $tool replay $out/recording.csv, or $out/grasp.csv"
  exit
fi
play_lime 600 $out/long.csv
emulate rubber $rubber $out/long.csv 600 --flash $out/flash.bin
processes=$!
wait_for_port rubber $processes
cat << END

The lime goes on slipping for ten minutes on a fingertip at FINGERTIP_PORT=$root/$out/rubber.tty. In another terminal, after

    export FINGERTIP_PORT=$root/$out/rubber.tty PATH=\$PATH:$root/${tool%/*}

try

    fingertip monitor                          # space would pause a replay, q ends, t tares
    fingertip info                             # who it is, how it is set, how its sensors are
    fingertip record - --seconds 5 | head      # its numbers, for a program of your own

Enter ends it.
END
read -r _ || true
