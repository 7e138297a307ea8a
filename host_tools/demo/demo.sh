#!/bin/sh
# A lime is gripped and slips, three times, on two emulated fingertips side by side: one with a pad of rubber and its
# errors, one with an ideal pad. Says how far each was off, and draws what the one of rubber felt. Then a gripper with two
# fingertips lifts an object in the simulated cell, which becomes slick and slips. Says how far, and draws it.
# Everything goes to build/demo; run by `sh cmake/bootstrap.sh demo`.
# usage: demo.sh [--stay]; --stay: goes on with the lime until Enter, to look at it
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
cd "$root"
out=build/demo
python=/usr/bin/python3
tool=build/host/host_tools/tool/cli/fingertip
board=$($python host_tools/report/shared/boards.py | head -n 1) # the fastest
seconds=14 # three slips: at 20, 50 and 100 mm/s
rubber=000000000000B0BB
ideal=000000000001DEA1
rm -rf $out
mkdir -p $out

fail() {
  for name in rubber ideal cell; do
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
    --serial "$serial" --scenario "$scenario" --seconds "$length" --pty $out/$name.tty --wait-open "$@" > $out/$name.log 2>&1 &
}

# NAME PROCESS
wait_for_port() {
  while [ ! -e $out/$1.tty ]; do
    kill -0 "$2" 2> /dev/null || fail "the emulator did not start"
    sleep 0.1
  done
}

# SECONDS FILE
play_lime() {
  build/host/host_tools/simulation/twin/twin scenario slip --indenter lime --layer 12 --effects gain=5,relaxation --seconds $1 --seed 3 \
    --cache build/host/contact_tables -o $2 > $out/twin.log 2>&1 || { cat $out/twin.log >&2; fail "the pad could not be computed"; }
}
play_lime $seconds $out/lime.csv
$python host_tools/demo/ideal.py $out/lime.csv -o $out/ideal.csv

processes=
trap 'kill $processes 2> /dev/null || true' EXIT
emulate rubber $rubber $out/lime.csv $seconds --report $out/rubber.json
rubber_process=$!
processes=$rubber_process
emulate ideal $ideal $out/ideal.csv 600 --report $out/ideal.json --seed 2
ideal_process=$!
processes="$rubber_process $ideal_process"
wait_for_port rubber $rubber_process
wait_for_port ideal $ideal_process

echo "== two fingertips at full rate: $rubber is of rubber, $ideal has an ideal pad"
for name in rubber ideal; do
  $tool set --port $out/$name.tty osr=256 rate=max > /dev/null || fail "the fingertip cannot be set"
done
FINGERTIP_PORT=$out/rubber.tty:$out/ideal.tty $tool monitor --device $rubber --device $ideal --until-gone --record $out/recording.csv ||
  fail "the monitor ended with an error"
wait $rubber_process || fail "the emulator found something wrong"
kill -INT $ideal_process 2> /dev/null || true # however far it came: it ends with the other
wait $ideal_process || [ $? -eq 130 ] || fail "the emulator found something wrong" # 130: interrupted while it ended
processes=

for name in rubber ideal; do
  [ $name = rubber ] && serial=$rubber scenario=$out/lime.csv || serial=$ideal scenario=$out/ideal.csv
  $python host_tools/python evaluate $out/recording.csv "$scenario" --device "$serial" --run $out/$name.json -o $out/$name.summary.json
done
$python host_tools/python plot $out/recording.csv --device $rubber --truth $out/lime.csv --run $out/rubber.json -o $out/demo.png
$python host_tools/demo/errors.py "12 mm of rubber=$out/rubber.summary.json" "ideal=$out/ideal.summary.json"
echo "The rubber's sensors differ by 5 %, it relaxes, and a lime's pressure is no Gaussian: fingertip calibrate finds what of it can be found."
echo "picture: $out/demo.png"

echo "== two fingertips on a gripper lift an object that becomes slick; the firmware on the host, all else simulated"
$tool simulate --lift --ports $out/cell --gripper 2f85 --mass 0.25 --friction 0.5 --kinetic 0.9 --then slick:0.65@1 --seconds 60 --patience 1 \
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
emulate rubber $rubber $out/long.csv 600
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
