#!/bin/bash
# Runs every test that was built, in both precisions, and the script tests; ends with one line of totals.
# BUILD names the build folder. Arguments select tests by substring.
set -u
cd "$(dirname "$0")/.."
BUILD=${BUILD:-build}
export BUILD
logs=$BUILD/test/logs
rm -rf "$logs"
mkdir -p "$logs"
export LSAN_OPTIONS="suppressions=$(pwd)/tests/leaks.supp:print_suppressions=0"
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=1} UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1}

list=$(find "$BUILD/test/f32" "$BUILD/test/f64" -type f -name 'test_*' -perm -u+x 2>/dev/null | sort)
scripts=$(find tests -name 'test_*.sh' | sort)
checks="tools/check_floors.sh tools/check_sizes.sh"
if [ $# -gt 0 ]; then
    pattern=$(printf '%s|' "$@")
    list=$(printf '%s\n' "$list" "$scripts" | grep -E "${pattern%|}")
    scripts=""
    checks=""
fi

run_one() {
    test=$1
    log=$logs/$(echo "$test" | tr '/' '_').log
    start=$(date +%s.%N)
    timeout "${TEST_TIMEOUT:-300}" "$test" >"$log" 2>&1
    code=$?
    seconds=$(awk -v a="$start" -v b="$(date +%s.%N)" 'BEGIN { printf "%.1f", b - a }')
    passed=$(sed -n 's/^\[  PASSED  \] \([0-9]*\) test.*/\1/p; s/^\([0-9]*\) passed, .*/\1/p' "$log" | awk '{ n += $1 } END { print n + 0 }')
    failed=$(sed -n 's/^\[  FAILED  \] \([0-9]*\) test(s).*/\1/p; s/^[0-9]* passed, \([0-9]*\) failed.*/\1/p' "$log" | awk '{ n += $1 } END { print n + 0 }')
    skipped=$(sed -n 's/^\[  SKIPPED \] \([0-9]*\) test(s).*/\1/p; s/^[0-9]* passed, [0-9]* failed, \([0-9]*\) skipped.*/\1/p' "$log" | awk '{ n += $1 } END { print n + 0 }')
    # A program that died, or that ran nothing, is a failure whatever it printed.
    if [ "$code" -ne 0 ] && [ "$failed" -eq 0 ]; then failed=1; fi
    if [ "$passed" -eq 0 ] && [ "$failed" -eq 0 ] && [ "$skipped" -eq 0 ]; then failed=1; fi
    printf '%s %s %s\n' "$passed" "$failed" "$skipped" >"$log.count"
    name=${test#"$BUILD"/test/}
    if [ "$failed" -gt 0 ]; then
        printf 'FAIL  %-60s (exit %s, %s s)\n' "$name" "$code" "$seconds"
        grep -vE '^\[ (RUN|      OK)' "$log" | tail -30 | sed 's/^/      | /'
    else
        printf 'ok    %-60s %4s passed %s s%s\n' "$name" "$passed" "$seconds" "$([ "$skipped" -gt 0 ] && echo ", $skipped skipped")"
        grep -E '^(skipped|skip):' "$log" | sed 's/^/      | /'
    fi
}
export -f run_one
export logs

for check in $checks; do
    if out=$($check 2>&1); then echo "1 0 0"; else echo "0 1 0"; fi >"$logs/$(basename "$check").log.count"
    echo "$out"
done
if [ $# -eq 0 ] && [ -f "$BUILD/lib/libjostle.a" ]; then
    for check in check_globals check_fma; do
        if out=$(tools/$check.sh "$BUILD/lib/libjostle.a" "$BUILD/lib/libjostle-f64.a" 2>&1); then echo "1 0 0"; else echo "0 1 0"; fi >"$logs/$check.log.count"
        echo "$out"
    done
fi
printf '%s\n' "$list" | grep . | xargs -P "$(nproc)" -I{} bash -c 'run_one {}'
# Scripts use the network namespace, the build folder and the command: one after the other.
for script in $scripts; do run_one "$script"; done

cat "$logs"/*.count | awk '{ p += $1; f += $2; s += $3 } END { printf "%d passed, %d failed, %d skipped\n", p, f, s; exit f > 0 || p == 0 }'
