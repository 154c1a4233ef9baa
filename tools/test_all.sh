#!/bin/bash
# make test, then the same tests under sanitizers, another compiler and other optimisation levels, and under valgrind.
set -u
cd "$(dirname "$0")/.."
failed=""
step() {
    name=$1
    shift
    echo "== $name"
    if "$@" >"build/test-all.log" 2>&1; then tail -n 1 build/test-all.log; else
        tail -n 40 build/test-all.log
        failed="$failed, $name"
    fi
}
mkdir -p build
step "plain" make test
step "address and undefined-behaviour sanitizers" make test SANITIZE=address,undefined
step "thread sanitizer" env TEST_TIMEOUT=1800 make test SANITIZE=thread
step "-O0" make test OPT=-O0 BUILD=build/O0
step "-O3" make test OPT=-O3 BUILD=build/O3
if command -v clang-16 >/dev/null; then step "clang" make test CC=clang-16 BUILD=build/clang; else echo "skipped: clang-16 is not installed"; fi
if command -v valgrind >/dev/null; then
    step "valgrind" valgrind -q --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite \
        build/bin/jostle run tools/scenes/showcase.json --seconds 0.2 --log build/valgrind.lcmlog
else echo "skipped: valgrind is not installed"; fi
# One scene, one seed, one hash: whatever the optimisation level.
same_hash() {
    set -- build/bin/jostle build/O0/bin/jostle build/O3/bin/jostle
    for jostle in "$@"; do
        for variant in "$jostle" "$jostle-f64"; do
            "$variant" run tools/scenes/showcase.json --seconds 2 --json |
                python3 -c 'import json,sys; d=json.load(sys.stdin); print(d["precision"], d["state_hash"])' || return 1
        done
    done | sort -u >build/hashes.txt
    cat build/hashes.txt
    [ "$(wc -l <build/hashes.txt)" = 2 ] # one line a precision
}
step "equal hashes at -O0, -O2, -O3" same_hash
if [ -n "$failed" ]; then
    echo "failed: ${failed#, }"
    exit 1
fi
echo "all passed"
