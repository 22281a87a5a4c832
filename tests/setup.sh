#!/usr/bin/env bash
# Installs what a fresh Debian or Ubuntu machine with Rust lacks to build gloss: Embree's header and library, and the
# libclang that bindgen reads the header with. Does nothing where they are there already.
set -euo pipefail

missing=()
compgen -G '/usr/include/embree[34]/rtcore.h' >/dev/null || missing+=(libembree-dev)
compgen -G '/usr/lib/llvm-*/lib/libclang*.so*' >/dev/null || missing+=(libclang-dev)
command -v cc >/dev/null || missing+=(gcc libc6-dev)
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "${missing[@]}"
