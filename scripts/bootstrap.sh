# shellcheck shell=bash
# Steps that ./quickstart and ./run-tests share. Sourced, not run; the working directory is the top of the tree.
# Each step looks first and does only what is missing, so a second run is quick and an interrupted one can be
# run again.

say() { printf '\n== %s\n' "$*"; }

# die WHAT HOW: what failed, and what to do about it.
die() {
  printf '\n%s: %s\n%s\n' "$(basename "$0")" "$1" "$2" >&2
  exit 1
}

# shellcheck disable=SC2034 # for those who source this
debian_packages_of_the_build=(build-essential cmake ninja-build pkg-config libeigen3-dev librandom123-dev
  libhdf5-dev libcli11-dev libtomlplusplus-dev nlohmann-json3-dev libnanoflann-dev zlib1g-dev)

# The first of these that is Python 3.11 or newer.
find_python() {
  local candidate
  for candidate in python3 /usr/bin/python3; do
    if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
      echo "$candidate"
      return
    fi
  done
}

# need_debian_packages NAME...: installs those that are not there.
need_debian_packages() {
  local wanted=("$@") missing=() name python root=()
  say "Debian packages"
  if ! command -v dpkg-query >/dev/null; then
    echo "no dpkg-query here: not a Debian system. If the build stops, these are what it needs: ${wanted[*]}"
    return
  fi
  # venv and pip are packages of their own, but only for Debian's Python.
  python=$(find_python)
  if [[ -z $python ]]; then
    wanted+=(python3 python3-venv)
  elif ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    wanted+=(python3-venv)
  fi
  for name in "${wanted[@]}"; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$name" 2>/dev/null) == installed* ]] || missing+=("$name")
  done
  if ((${#missing[@]} == 0)); then
    echo "all there"
    return
  fi
  echo "missing: ${missing[*]}"
  if (($(id -u) != 0)); then
    command -v sudo >/dev/null ||
      die "Debian packages are missing, and this is neither root nor is there sudo" \
        "As root: apt-get update && apt-get install ${missing[*]}"
    root=(sudo)
  fi
  if ! { "${root[@]}" apt-get update && "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y --no-install-recommends "${missing[@]}"; }; then
    die "apt-get could not install ${missing[*]}" "Mend what it says above, then run ./$(basename "$0") again."
  fi
}

# need_python_packages NAME REQUIREMENT...: into .venv, once; NAME tells the sets of packages apart.
need_python_packages() {
  local stamp=.venv/packages-of-$1 python state half=.venv/half-made
  shift
  say "Python packages (.venv)"
  state=$(printf '%s\n' "$@"; cat tests/requirements.txt)
  if [[ ! -e $half && -x .venv/bin/python && -f $stamp && $(<"$stamp") == "$state" ]] &&
    .venv/bin/python -c '' 2>/dev/null; then
    echo "all there"
    return
  fi
  if [[ -e $half ]] || ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
    python=$(find_python)
    [[ -n $python ]] || die "no Python 3.11 or newer" "Install one (Debian 12: apt-get install python3) and run this again."
    rm -rf .venv
    mkdir .venv
    touch "$half"
    "$python" -m venv .venv || die "$python could not make a virtual environment" "Debian: apt-get install python3-venv"
  fi
  touch "$half" # an installation that is cut off here must not look complete next time
  .venv/bin/python -m pip install --disable-pip-version-check --quiet "$@" ||
    die "pip could not install $*" "Is the network there? Run ./$(basename "$0") again."
  printf '%s\n' "$state" >"$stamp"
  rm "$half"
}

# The CMake of the PATH, or Debian's if that one is too old.
find_cmake() {
  local candidate version
  for candidate in cmake /usr/bin/cmake; do
    version=$("$candidate" --version 2>/dev/null | sed -n '1s/cmake version //p') || continue
    if [[ -n $version && $(printf '%s\n3.25\n' "$version" | sort -V | head -n 1) == 3.25 ]]; then
      echo "$candidate"
      return
    fi
  done
}

# build PRESET TARGET [CMAKE-OPTION...]
build() {
  local preset=$1 target=$2 cmake log
  shift 2
  say "Build ($preset)"
  cmake=$(find_cmake)
  [[ -n $cmake ]] || die "no CMake 3.25 or newer" "Debian 12: apt-get install cmake"
  mkdir -p "build/$preset"
  log=build/$preset/configure.log
  if ! "$cmake" --preset "$preset" "$@" >"$log" 2>&1; then
    cat "$log" >&2
    die "CMake could not configure build/$preset" "Mend what it says above; rm -r build/$preset starts afresh."
  fi
  "$cmake" --build "build/$preset" --target "$target" -j "$(nproc)" ||
    die "build/$preset did not build" "The first error above says why; rm -r build/$preset starts afresh."
}
