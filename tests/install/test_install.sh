#!/bin/bash
# The installed tree: the README's program compiles as printed through the .pc files, in both precisions, shared and
# static; a mismatch of precision does not link; uninstall leaves nothing.
set -u
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
if [ -n "${SANITIZE:-}" ]; then
    echo "skipped: installed libraries are not tested under sanitizers"
    echo "0 passed, 0 failed, 1 skipped"
    exit 0
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
passed=0
failed=0
check() {
    name=$1
    shift
    if "$@" >"$work/out" 2>&1; then passed=$((passed + 1)); else
        failed=$((failed + 1))
        echo "FAILED $name"
        tail -8 "$work/out" | sed 's/^/  /'
    fi
}
prefix=$work/prefix
check "make install" make --no-print-directory install PREFIX="$prefix" BUILD="$BUILD"
export PKG_CONFIG_PATH=$prefix/lib/pkgconfig LD_LIBRARY_PATH=$prefix/lib
awk '/^```c$/ { on = 1; next } /^```$/ { if (on) exit } on' README.md >"$work/hello.c"
check "the README's program is at most 25 lines" test "$(wc -l <"$work/hello.c")" -le 25 -a "$(wc -l <"$work/hello.c")" -ge 15
cc=${CC:-gcc}
flags="-std=c17 -Wall -Wextra -Werror"
for p in jostle jostle-f64; do
    # shellcheck disable=SC2046,SC2086
    check "the README's program compiles with $p" $cc $flags "$work/hello.c" $(pkg-config --cflags --libs $p) -o "$work/hello-$p"
    check "and runs" bash -c "'$work/hello-$p' >'$work/said'"
    check "and says what it should" grep -qE '^box at z = 0\.[45][0-9]* m, [0-9]+ particles' "$work/said"
    # shellcheck disable=SC2046,SC2086
    check "it links statically with $p" $cc $flags "$work/hello.c" $(pkg-config --cflags $p) "$prefix/lib/lib$p.a" -lm -pthread -o "$work/static-$p"
    check "and runs" env LD_LIBRARY_PATH= "$work/static-$p"
done
# shellcheck disable=SC2046
check "float program with double library does not link" bash -c "! $cc -std=c17 '$work/hello.c' $(pkg-config --cflags jostle) $(pkg-config --libs jostle-f64) -o '$work/mixed' 2>&1"
for l in jostle-scene jostle-lcm jostle-render; do check "pkg-config knows $l" pkg-config --exists --print-errors $l; done
check "the installed command runs" "$prefix/bin/jostle" --version
check "the soname is versioned" bash -c "readelf -d '$prefix/lib/libjostle.so' | grep -q 'SONAME.*libjostle.so.0'"
check "nothing but the interface is exported" bash -c "! nm -D --defined-only '$prefix/lib/libjostle.so' | grep -E ' [TDB] ' | grep -vE ' jsl_'"
check "make uninstall" make --no-print-directory uninstall PREFIX="$prefix" BUILD="$BUILD"
check "nothing is left" test -z "$(find "$prefix" -type f -o -type l)"
echo "$passed passed, $failed failed, 0 skipped"
[ $failed -eq 0 ]
