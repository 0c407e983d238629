# shellcheck shell=bash
# What demo.sh and tests/run.sh share: packages, build, a network with multicast. Source it in bash
# with `root` set to the folder of the repository.
#
# The build folder is $CRADLE_BUILD, or build in the repository.

build_dir=${CRADLE_BUILD:-$root/build}
packages=(g++ cmake ninja-build liblcm-dev liblcm-bin libeigen3-dev libfcl-dev libqhull-dev catch2
          libtomlplusplus-dev libcli11-dev libspdlog-dev libxxhash-dev nlohmann-json3-dev iproute2
          lua5.2 liblcm-lua pkg-config groff-base dpkg-dev file gnuplot-nox)

# Runs a command in silence; if it fails, shows the end of what it said.
quietly() {
  local log code=0
  log=$(mktemp)
  "$@" >"$log" 2>&1 || code=$?
  if ((code != 0)); then
    tail -n 40 "$log" >&2
    echo "failed: $*" >&2
  fi
  rm -f "$log"
  return $code
}

# Installs what is missing, by apt.
install_packages() {
  local package missing=() sudo=()
  for package in "${packages[@]}"; do
    dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed ||
      missing+=("$package")
  done
  ((${#missing[@]} == 0)) && return 0
  ((EUID == 0)) || sudo=(sudo)
  echo "installing ${missing[*]}"
  quietly "${sudo[@]}" apt-get update &&
    quietly "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive \
      apt-get install -y --no-install-recommends "${missing[@]}"
}

# Builds the targets named, or everything, with the options of cmake before `--`.
# build_programs [-DOPTION=VALUE...] -- [TARGET...]
build_programs() {
  local options=() targets=()
  while (($# > 0)) && [[ $1 != -- ]]; do options+=("$1") && shift; done
  (($# > 0)) && shift
  (($# > 0)) && targets=(--target "$@")
  [[ -e $build_dir/CMakeCache.txt ]] || options+=(-G Ninja)
  quietly cmake -S "$root" -B "$build_dir" "${options[@]}" &&
    quietly cmake --build "$build_dir" "${targets[@]}"
}

# Finds a network in which multicast comes back: one of our own if the host allows that, else the
# host's as it is; its routes are left alone. Sets `network`, a command that runs a command in there,
# and `network_kind`: -n, -rn or host.
find_network() {
  local setup='ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$@"'
  for network_kind in -n -rn; do  # as root, or as root of a user namespace of our own
    network=(unshare "$network_kind" sh -c "$setup" sh)
    "${network[@]}" true 2>/dev/null && return 0
  done
  network=(env)
  network_kind=host
  ip route get 239.255.76.67 >/dev/null 2>&1 && return 0
  echo "no multicast here; type, as root: ip link set lo up && ip route add 224.0.0.0/4 dev lo" >&2
  return 69
}

# Runs a command there.
in_network() { "${network[@]}" "$@"; }

# A port that nobody uses, nor the one after it; below those that Linux lends to any socket.
free_port() {
  local port
  while port=$((20000 + RANDOM % 12000)); do
    ss -Huln "( sport = :$port or sport = :$((port + 1)) )" | grep -q . || break
  done
  echo "$port"
}
