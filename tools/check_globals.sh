#!/bin/sh
# Fails when an archive holds a mutable object with static storage. Constant tables of pointers live in
# .data.rel.ro, which the loader seals: they are allowed.
set -eu
status=0
for archive in "$@"; do
    # The instrumentation of sanitizers adds symbols of its own.
    found=$(nm -A -f sysv "$archive" 2>/dev/null |
        awk -F'|' '$3 ~ /^ *[bBdDcCsSgG] *$/ && $7 !~ /\.data\.rel\.ro/ && $1 !~ /__(asan|ubsan|tsan|sancov|msan|odr_asan)|\.L|\*\.L/ { print $1, $7 }')
    if [ -n "$found" ]; then
        echo "$archive holds mutable globals:"
        echo "$found"
        status=1
    fi
done
[ $status = 0 ] && echo "globals: ok"
exit $status
