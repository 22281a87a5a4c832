#!/usr/bin/env bash
# Installs what a fresh Debian or Ubuntu machine with Rust lacks to build gloss: Embree's header and library, and the
# libclang that bindgen reads the header with. Does nothing where they are there already.
#
# `--list` names the missing packages and installs none; `ROOT` is looked into in place of /.
set -euo pipefail
root=${ROOT:-}

missing=()
compgen -G "$root/usr/include/embree[34]/rtcore.h" >/dev/null || missing+=(libembree-dev)
# Of the package itself: llvm-dev brings a libclang-cpp.so, which bindgen cannot use.
compgen -G "$root/usr/lib/llvm-*/lib/libclang.so" >/dev/null || missing+=(libclang-dev)
command -v cc >/dev/null || missing+=(gcc libc6-dev)
if [ "${1:-}" = --list ]; then
    echo "${missing[@]}"
    exit
fi
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "${missing[@]}"
