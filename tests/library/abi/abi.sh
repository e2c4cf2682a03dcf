#!/bin/sh
# abi.sh: compares the interface of a libclamor.so with the committed dump (libabigail).
#
#   abi.sh check LIBRARY   fails if a program built against the dump's version could not run; prints
#                          what was added
#   abi.sh prove LIBRARY   fails unless a removed function and changed members are noticed
#   abi.sh renew LIBRARY   writes the dump: after additions, or for a new ABI version
set -eu
folder=$(cd "$(dirname "$0")" && pwd)
dump=$folder/libclamor.abi
command -v abidw >/dev/null && command -v abidiff >/dev/null || {
  echo "not on this machine: abidw and abidiff (abigail-tools)"
  exit 77
}

# Only what clamor.h declares: no private types, no names of files or of other libraries.
dump_of() {
  abidw --headers-dir "$work/include" --drop-private-types --exported-interfaces-only \
    --no-show-locs --no-corpus-path --no-comp-dir-path --no-elf-needed "$1"
}

# Whether all that abidiff reports are new functions, and members that were appended to structures
# beginning with `bytes`, which may grow.
compatible() {
  result=0
  abidiff --no-added-syms --no-show-locs "$1" "$2" >"$work/report" || result=$?
  test $result -ne 0 || return 0
  awk '
    /^Functions changes summary: 0 Removed/ { compared = 1; next }
    /^Variables changes summary: 0 Removed, 0 Changed/ || NF == 0 { next }
    /functions? with some indirect sub-type change|has some indirect sub-type changes:$/ { next }
    /parameter [0-9]+ of type .* has sub-type changes:$|in pointed to type|underlying type/ {
      grows = grows || /struct clamor_(options|reader|level_info|listener_options|listener_statistics|sound_options|stream|group_options|source_options|voices|emitter_info|emitter_options|portal_info|part_info|part_options)/
      next
    }
    /type size changed from [0-9]+ to [0-9]+/ { size = $5; next }
    /data member insertions?:$/ { next }
    / at offset [0-9]+ / && grows {
      for (i = 1; i < NF; ++i) if ($i == "offset" && $(i + 1) >= size && size > 0) next
    }
    { print; changed = 1 }
    END { exit !compared || changed }' "$work/report" || {
    cat "$work/report"
    return 1
  }
}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/include"
cp "$folder/../../../runtime/clamor.h" "$work/include"
dump_of "$2" >"$work/now.abi"
case $1 in
  check)
    if ! compatible "$dump" "$work/now.abi"; then
      echo "programs of an earlier build would not run with this library; undo the change, or raise"
      echo "CLAMOR_ABI_VERSION and renew the dump: cmake --build build/release --target renew_abi"
      exit 1
    fi ;;
  prove)
    # Each fault is made in a copy of the dump.
    change() { sed "$2" "$dump" >"$work/$1.abi"; }
    change removed "/elf-symbol name='clamor_render'/d"
    change retyped "s/name='rate_hz' type-id='[^']*'/name='rate_hz' type-id='type-id-1'/"
    change moved "s/offset-in-bits='192'/offset-in-bits='224'/"
    for fault in removed retyped moved; do
      if cmp -s "$dump" "$work/$fault.abi"; then echo "$fault: the dump is as before"; exit 1; fi
      if compatible "$dump" "$work/$fault.abi" >/dev/null; then echo "$fault: not noticed"; exit 1; fi
    done
    compatible "$dump" "$work/now.abi" ;;
  renew)
    cp "$work/now.abi" "$dump"
    wc -c "$dump" ;;
esac
