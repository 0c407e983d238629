#!/usr/bin/env bash
# One command: installs what is missing, builds everything, runs the tests in a network of their own.
#
# Usage: tests/run.sh [--sanitize address,undefined|thread] [--option -DX=Y] [--target NAME]
#                     [CTEST OPTION...]
#   tests/run.sh                    all tests but the long ones
#   tests/run.sh -L unit            those of one folder: unit, physics, steady, peers, wire, integration, bench
#   tests/run.sh -L long            the long ones: endurance
#   tests/run.sh -R "eight client"  those whose name matches
# With --target, which may come several times, that alone is built.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
options=(-DCMAKE_BUILD_TYPE=Release)
targets=()
folder=build
while (($# > 0)); do
  case $1 in
    --sanitize)
      options+=("-DCRADLE_SANITIZE=${2:?--sanitize needs a list}")
      folder=build-${2//,/-}
      # A race in a daemon that a test started must end it, with a code that is none of ours.
      [[ $2 == thread ]] && export TSAN_OPTIONS="halt_on_error=1 exitcode=99 ${TSAN_OPTIONS:-}"
      shift 2
      ;;
    --option) options+=("${2:?--option needs one for cmake}") && shift 2 ;;
    --target) targets+=("${2:?--target needs a name}") && shift 2 ;;
    -h | --help) sed -n '2,/^set/s/^# \?//p' "${BASH_SOURCE[0]}" | head -n -1 && exit 0 ;;
    *) break ;;
  esac
done
export CRADLE_BUILD=${CRADLE_BUILD:-$root/$folder}
source "$root/server/network.sh"

install_packages
echo "building $build_dir"
build_programs "${options[@]}" -- "${targets[@]}"
find_network
# The long tests run when they are asked for.
[[ " $* " == *" -L"* || " $* " == *" --label-regex"* ]] || set -- -LE '^long$' "$@"
# One more than there are processors: a third of the tests wait for processes and clocks.
in_network ctest --test-dir "$build_dir" --output-on-failure -j "$(($(nproc) + 1))" "$@"
