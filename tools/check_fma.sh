#!/bin/sh
# Fails when an archive holds a fused multiply-add: with it, results would depend on the instruction set.
set -eu
status=0
for archive in "$@"; do
    n=$(objdump -d --no-show-raw-insn "$archive" 2>/dev/null | grep -cE '\svfn?m(add|sub)' || true)
    if [ "$n" != 0 ]; then
        echo "$archive: $n fused multiply-adds"
        status=1
    fi
done
[ $status = 0 ] && echo "contraction: none"
exit $status
