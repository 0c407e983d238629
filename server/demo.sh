#!/usr/bin/env bash
# One command: installs what is missing, builds, starts a world on this host, lets one client play
# in it and another show what moves. Ends after ten seconds.
#
# Usage: server/demo.sh [--keep] [--seconds N]
#   --keep       leaves the server running, and says how to talk to it
#   --seconds N  how long the clients play (default 10)
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
source "$root/server/network.sh"
bin=$build_dir/bin
seconds=10
keep=no
inside=

while (($# > 0)); do
  case $1 in
    --keep) keep=yes ;;
    --seconds) seconds=${2:?--seconds needs a number} && shift ;;
    --inside) inside=${2:?} && shift ;;  # for ourselves: in the network that find_network found
    *) sed -n '2,/^set/s/^# \?//p' "${BASH_SOURCE[0]}" >&2 && exit 2 ;;
  esac
  shift
done

say() { printf '%-9s %s\n' "$1" "$2"; }

if [[ -z $inside ]]; then
  install_packages
  say build "$bin, which takes minutes the first time"
  build_programs -DCMAKE_BUILD_TYPE=Release -- cradled cradle example_play
  find_network
  [[ $keep == yes ]] && set -- --keep
  exec "${network[@]}" "${BASH_SOURCE[0]}" "$@" --seconds "$seconds" --inside "$network_kind"
fi

port=7667
[[ $inside == host ]] && port=$(free_port)
export CRADLE_WORLD=demo CRADLE_LCM_URL="udpm://239.255.76.67:$port?ttl=0"
work=$(mktemp -d)
children=()
finish() {
  rm -rf "$work"
  ((${#children[@]} > 0)) || return 0
  kill "${children[@]}" 2>/dev/null || true
  wait "${children[@]}" 2>/dev/null || true
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# In a session of its own, the server outlives this terminal if it is to be kept.
setsid "$bin/cradled" serve --scene "$root/tests/scenes/demo.toml" --world "$CRADLE_WORLD" \
  --lcm-url "$CRADLE_LCM_URL" >"$work/cradled.log" 2>&1 &
server=$!
children+=("$server")
if ! "$bin/cradle" status >"$work/status" 2>"$work/error"; then
  cat "$work/cradled.log" "$work/error" >&2
  exit 69
fi

[[ $inside == host ]] && where="this host's" || where="a network of its own"
say network "$where, $CRADLE_LCM_URL"
say server "cradled, world demo, tests/scenes/demo.toml"
say clients "one drops bodies and kicks them, one watches:"
echo

"$bin/example_play" "$seconds" >"$work/play" 2>&1 &
player=$!
"$bin/cradle" watch --seconds "$seconds" &
watcher=$!
children+=("$player" "$watcher")
wait "$watcher"
wait "$player" || { cat "$work/play" "$work/cradled.log" >&2 && exit 1; }
children=("$server")

[[ -t 1 ]] && echo
say played "$(<"$work/play")"
if [[ $keep == yes ]]; then
  enter=
  [[ $inside == -n ]] && enter="nsenter -t $server -n "
  [[ $inside == -rn ]] && enter="nsenter -t $server -U -n --preserve-credentials "
  children=()
  say kept "cradled goes on as process $server; look at it, and end it, with"
  echo "  ${enter}$bin/cradle --lcm-url '$CRADLE_LCM_URL' --world demo watch"
  echo "  kill $server"
fi
