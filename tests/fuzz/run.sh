#!/usr/bin/env bash
# Builds the fuzz targets with clang and lets libFuzzer loose on them, from the kept corpus on; two at
# a time. What it finds is in build-fuzz/found/<target>; ends with 1 if an input crashed, hung, leaked
# or took too much memory: that input is build-fuzz/found/<target>.<kind>-<hash>.
#
# Usage: tests/fuzz/run.sh [--seconds 60] [--keep] [TARGET...]
#   --seconds N   for each target
#   --keep        replaces the kept corpus by the smallest one that reaches as much, and its seeds
#   TARGET        receiver, decoders, commands, worlds, client or geometry; all without
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
seconds=60
keep=false
targets=()
while (($# > 0)); do
  case $1 in
    --seconds) seconds=${2:?--seconds needs a number} && shift 2 ;;
    --keep) keep=true && shift ;;
    -h | --help) sed -n '2,/^set/s/^# \?//p' "${BASH_SOURCE[0]}" | head -n -1 && exit 0 ;;
    *) targets+=("$1") && shift ;;
  esac
done
((${#targets[@]} > 0)) || targets=(commands worlds geometry client receiver decoders)
export CRADLE_BUILD=${CRADLE_BUILD:-$root/build-fuzz}
source "$root/server/network.sh"
corpus=$root/tests/fuzz/corpus
found=$build_dir/found

packages+=(clang)
install_packages
echo "building $build_dir"
build_programs -DCMAKE_CXX_COMPILER=clang++ -DCRADLE_FUZZ=ON -- fuzz_seeds "${targets[@]/#/fuzz_}"
find_network
mkdir -p "$found"

fuzz() {
  local target=$1 log=$found/$1.log
  mkdir -p "$found/$target"
  if in_network "$build_dir/bin/fuzz_$target" -max_total_time="$seconds" -timeout=10 \
    -rss_limit_mb=1024 -malloc_limit_mb=64 -max_len=2048 -artifact_prefix="$found/$target." \
    -print_final_stats=1 "$found/$target" "$corpus/$target" >"$log" 2>&1; then
    echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") inputs," \
      "$(grep -o 'cov: [0-9]*' "$log" | tail -n 1 | cut -c6-) edges reached"
  else
    tail -n 40 "$log"
    echo "$target: failed; the whole story is in $log"
    return 1
  fi
}

# What reaches an edge that nothing smaller reaches. What has a name of its own stays: findings, seeds.
keep_corpus() {
  local target=$1 kept=$found/$1.kept
  rm -rf "$kept" && mkdir "$kept"
  cp "$corpus/$target"/*[!0-9a-f]* "$kept"
  in_network "$build_dir/bin/fuzz_$target" -set_cover_merge=1 -use_counters=0 -max_len=2048 "$kept" "$corpus/$target" \
    "$found/$target" >"$found/$target.merge.log" 2>&1
  rm -rf "${corpus:?}/$target" && mv "$kept" "$corpus/$target"
}

# A target that fails does not stop the others: all findings of a run are shown.
code=0
for ((i = 0; i < ${#targets[@]}; i += 2)); do
  running=()
  for target in "${targets[@]:i:2}"; do
    fuzz "$target" &
    running+=($!)
  done
  for process in "${running[@]}"; do wait "$process" || code=1; done
done
if $keep && ((code == 0)); then
  "$build_dir/bin/fuzz_seeds" "$corpus"
  for target in "${targets[@]}"; do keep_corpus "$target"; done
  du -sh "$corpus"
fi
exit $code
