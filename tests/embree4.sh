#!/bin/sh
# Runs the conformance tests against Embree 4, in a chroot of Debian 13, whose libembree-dev it is.
#
#   tests/embree4.sh [cargo arguments]     default: test --test conformance -- embree
#
# Needs root, and a mirror of Debian the first time: where it cannot be reached, the script says so in one line and
# ends well. The chroot (EMBREE4_ROOT, default target/embree4/root) and what cargo builds in it are kept for the
# next run. Rust and its registry are this machine's own, mounted; nothing is downloaded inside.
set -eu

checkout=$(cd "$(dirname "$0")/.." && pwd)
root=${EMBREE4_ROOT:-$checkout/target/embree4/root}
target=${EMBREE4_TARGET:-$checkout/target/embree4/build}
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
packages=libembree-dev,libclang-dev,gcc,libc6-dev
cargo_home=${CARGO_HOME:-$HOME/.cargo}
rustup_home=${RUSTUP_HOME:-$HOME/.rustup}
[ $# -gt 0 ] || set -- test --test conformance -- embree

fail() {
    echo "embree4.sh: $1" >&2
    exit 1
}

[ "$(id -u)" = 0 ] || fail "needs root for chroot and mount"
command -v cargo >/dev/null || fail "needs cargo"
if ! command -v debootstrap >/dev/null; then
    apt-get install -y --no-install-recommends debootstrap >/dev/null || fail "needs debootstrap"
fi

# A root that was not finished is started anew.
if [ ! -e "$root/.complete" ]; then
    if ! wget -q -T 20 -t 1 -O /dev/null "$mirror/dists/trixie/InRelease"; then
        echo "embree4.sh: skipped, since $mirror cannot be reached"
        exit 0
    fi
    rm -rf --one-file-system "$root"
    mkdir -p "$root"
    log=$root.log
    debootstrap --variant=minbase --include=$packages trixie "$root" "$mirror" >"$log" 2>&1 \
        || fail "debootstrap failed, see $log"
    touch "$root/.complete"
fi

mounted=
unmount() {
    for dir in $mounted; do
        umount "$dir" || umount -l "$dir"
    done
}
trap unmount EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# bind FROM TO [OPTIONS]: FROM appears at TO inside the root.
bind() {
    mkdir -p "$1" "$root$2"
    mount --bind "$1" "$root$2"
    mounted="$root$2 $mounted"
    [ -z "${3:-}" ] || mount -o "remount,bind,$3" "$root$2"
}

(cd "$checkout" && cargo fetch --locked --quiet)
bind "$checkout" /gloss ro
bind "$cargo_home" /cargo
bind "$rustup_home" /rustup ro
bind "$target" /build
mount -t proc proc "$root/proc"
mounted="$root/proc $mounted"
bind /dev /dev

chroot "$root" /usr/bin/env -i \
    HOME=/root LANG=C.UTF-8 PATH=/cargo/bin:/usr/bin:/bin TMPDIR=/tmp \
    CARGO_HOME=/cargo RUSTUP_HOME=/rustup RUSTUP_TOOLCHAIN="$(rustup show active-toolchain | cut -d' ' -f1)" \
    CARGO_TARGET_DIR=/build CARGO_NET_OFFLINE=true CARGO_PROFILE_DEV_DEBUG=false \
    /bin/sh -c 'cd /gloss && exec cargo "$@"' cargo "$@"
