# setup.sh: what tools/demo and tools/test share: the packages, and steps that report in one line.
#
# Sourced, from the repository's root. Full output of every step goes to a log under build/, which is
# shown when the step fails.
# shellcheck shell=bash

export LC_ALL=C.UTF-8
# A compiler cache, where there is one, serves every clone of this repository.
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=1
mkdir -p build

# now_ms, seconds_since MS: "12.3 s"
now_ms() { echo $((${EPOCHREALTIME/./} / 1000)); }
seconds_since() {
  local tenths=$((($(now_ms) - $1 + 50) / 100))
  printf '%d.%d s' $((tenths / 10)) $((tenths % 10))
}

# line WHAT TEXT TIME: one line of the report
line() { printf '  %-18s %-58s %8s\n' "$1" "$2" "${3:-}"; }

# While a step runs on a terminal: what it says it has done so far, as in [17/90].
show_progress() {
  local count
  while sleep 1; do
    count=$(tail -c 4000 "$3" 2>/dev/null | grep -oE '^ *\[?[0-9]+/[0-9]+' | tail -n 1 | tr -d ' [' || true)
    printf '\r  %-18s %-58s %8s' "$1" "$2" "$count"
  done
}

last_lines() { tail -n 60 "$1"; }

# step WHAT TEXT COMMAND...: runs the command with its output in build/WHAT.log and reports it. When it
# fails, prints what $excerpt makes of the log.
step() {
  local what=$1 text=$2 log=build/${1// /_}.log began watcher='' failed=0
  shift 2
  began=$(now_ms)
  : >"$log"
  if [[ -t 1 ]]; then
    show_progress "$what" "$text" "$log" &
    watcher=$!
  fi
  "$@" >"$log" 2>&1 </dev/null || failed=$?
  if [[ -n $watcher ]]; then
    kill "$watcher" 2>/dev/null || true
    wait "$watcher" 2>/dev/null || true
    printf '\r'
  fi
  if ((failed)); then
    line "$what" "$text" "FAILED"
    ${excerpt:-last_lines} "$log" | sed 's/^/    /'
    echo "  All of it is in $log."
    return 1
  fi
  line "$what" "$text" "$(seconds_since "$began")"
}

# packages demo|test: those of packages.txt, as words
packages() {
  if [[ $1 == demo ]]; then sed '/^# for tests/,$d' tools/packages.txt; else cat tools/packages.txt; fi |
    grep -v '^#' | xargs
}

install_with() {
  local -a get=("$@" env DEBIAN_FRONTEND=noninteractive apt-get -o Acquire::Retries=3
    -o DPkg::Lock::Timeout=300)
  # The lists of a fresh system are empty and those of an old one name packages that are gone.
  "${get[@]}" install -y --no-install-recommends "${missing[@]}" ||
    { "${get[@]}" update && "${get[@]}" install -y --no-install-recommends "${missing[@]}"; }
}

# install_packages demo|test [NAMES]: installs what is missing, or says how
install_packages() {
  local -a wanted missing=()
  local name there began
  began=$(now_ms)
  read -ra wanted <<<"$(packages "$1") ${*:2}"
  if ! command -v dpkg-query apt-get >/dev/null; then
    line packages "not a Debian: hoping that CMake finds everything"
    return
  fi
  there=" $(dpkg-query -W -f '${db:Status-Status}:${Package} ' "${wanted[@]}" 2>/dev/null || true) "
  for name in "${wanted[@]}"; do
    # Builds of Node.js by others contain npm, and conflict with the package.
    [[ $there == *" installed:$name "* || ($name == npm && -n $(command -v npm)) ]] || missing+=("$name")
  done
  if ((${#missing[@]} == 0)); then
    line packages "all ${#wanted[@]} are installed" "$(seconds_since "$began")"
    return
  fi
  local text="installing ${#missing[@]} Debian packages and what they need"
  if [[ $(id -u) == 0 ]]; then
    step packages "$text" install_with
  elif command -v sudo >/dev/null && { sudo -n true 2>/dev/null || { [[ -t 0 ]] && sudo -v; }; }; then
    step packages "$text" install_with sudo -n
  else
    echo "Some Debian packages are missing, and installing them needs root. Run this, then try again:"
    echo "  apt-get update && apt-get install -y --no-install-recommends ${missing[*]}"
    return 1
  fi
}
