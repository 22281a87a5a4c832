#!/bin/sh
# Runs the tests of the border to Embree under valgrind: reads and writes out of bounds, uninitialised values that
# decide anything, and what is lost. Some minutes.
set -eu
cd "$(dirname "$0")/.."
command -v valgrind >/dev/null || { echo "valgrind.sh: needs valgrind" >&2; exit 1; }

binary=$(cargo test --test embree_boundary --no-run --message-format=json 2>/dev/null \
    | sed -n 's/.*"name":"embree_boundary".*"executable":"\([^"]*\)".*/\1/p')
[ -n "$binary" ] || { echo "valgrind.sh: the tests do not build" >&2; exit 1; }
exec valgrind --error-exitcode=1 --leak-check=full --errors-for-leak-kinds=definite \
    --show-leak-kinds=definite "$binary" --test-threads=1 "$@"
