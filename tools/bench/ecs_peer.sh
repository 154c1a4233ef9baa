#!/bin/sh
# Times the ECS of jostle beside flecs and plain arrays. cargo fetches the crate flecs_ecs_sys, which carries
# flecs.c; it is compiled here with the flags most favourable to it. Arguments go to the program: --json,
# --detail, --only move|tables|changes, --repeats N, --max ENTITIES. BUILD, CC, MAKE and FLECS_CFLAGS may be set, and
# LIBJOSTLE to a libjostle.a that is built already. Without cargo it says so and leaves with 0.
set -eu
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
CC=${CC:-gcc}
MAKE=${MAKE:-make}
version=0.2.1 # of the crate; it carries flecs 4.1.2
out=$BUILD/peers/flecs
lib=${LIBJOSTLE:-$BUILD/lib/libjostle.a}
fast="-O3 -march=native -ffp-contract=off"

if ! command -v cargo >/dev/null 2>&1; then
    echo "ecs_peer: cargo is not installed, so flecs cannot be fetched: nothing measured" >&2
    exit 0
fi
mkdir -p "$out/src"
cat >"$out/Cargo.toml" <<EOF
# Only there so that cargo fetches the crate that carries flecs.c.
[package]
name = "flecs_link"
version = "0.1.0"
edition = "2021"
publish = false

[dependencies]
flecs_ecs_sys = { version = "=$version", default-features = false }

[workspace]
EOF
: >"$out/src/lib.rs"
if ! cargo metadata --quiet --format-version 1 --manifest-path "$out/Cargo.toml" >"$out/metadata.json"; then
    echo "ecs_peer: cargo could not fetch flecs_ecs_sys $version: nothing measured" >&2
    exit 1
fi
crate=$(tr ',' '\n' <"$out/metadata.json" | sed -n 's/.*"manifest_path":"\(.*flecs_ecs_sys-.*\)\/Cargo.toml".*/\1/p' | head -n 1)
if [ ! -f "$crate/src/flecs.c" ]; then
    echo "ecs_peer: the crate holds no src/flecs.c: nothing measured" >&2
    exit 1
fi

[ -n "${LIBJOSTLE:-}" ] || "$MAKE" --no-print-directory BUILD="$BUILD" CC="$CC" "$lib" >&2
if [ ! -f "$out/flecs.o" ] || [ "$crate/src/flecs.c" -nt "$out/flecs.o" ]; then
    echo "  CC     flecs.c" >&2
    # Release mode and no addons but the clock and the memory of the system: flecs at its leanest.
    # shellcheck disable=SC2086
    "$CC" -std=gnu17 -O3 -march=native -DNDEBUG -DFLECS_CUSTOM_BUILD -DFLECS_OS_API_IMPL ${FLECS_CFLAGS:-} \
        -w -c "$crate/src/flecs.c" -o "$out/flecs.o.new"
    mv "$out/flecs.o.new" "$out/flecs.o"
fi
# shellcheck disable=SC2086
"$CC" -std=gnu17 $fast -DNDEBUG -DFLECS_CUSTOM_BUILD -DFLECS_OS_API_IMPL -Wall -Wextra -Wshadow -g \
    -Iinclude -isystem "$crate/src" tools/bench/ecs_peer.c "$out/flecs.o" "$lib" -lm -lpthread -o "$BUILD/peers/ecs_peer"
exec "$BUILD/peers/ecs_peer" "$@"
