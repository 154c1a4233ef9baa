#!/bin/bash
# Every example builds (make examples), ends with status 0 and says what it should.
set -u
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
examples=$(pwd)/$BUILD/examples
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
        tail -5 "$work/out" | sed 's/^/  /'
    fi
}
# says NAME PATTERN: the example's exit status is 0 and a line of its output matches.
says() {
    (cd "$work" && "$examples/$1" >"$1.txt" 2>&1)
    check "$1 ends with status 0" test $? -eq 0
    check "$1 says $2" grep -qE "$2" "$work/$1.txt"
}
says hello '^box at z = 0\.(49|50)[0-9]* m, 20[0-9]{2} particles$'
check "hello is the program of the README" bash -c \
    "diff <(awk '/^\`\`\`c\$/{on=1;next} /^\`\`\`\$/{on=0} on' README.md | tr -d ' \\n') <(sed 1,/pkg-config/d tools/examples/hello.c | sed '1{/\\*\\//d}' | tr -d ' \\n')"
says temperature 'equal hashes'
check "the block has warmed" awk '$1 == "3.0" && $4 > 330 && $4 < 360 { ok = 1 } END { exit !ok }' "$work/temperature.txt"
check "the log exports" "$BUILD/bin/jostle" log export "$work/temperature.lcmlog" --channel temperature -o "$work/t.csv"
check "with its unit" grep -q '^step,time \[s\],id,kelvin \[K\]$' "$work/t.csv"
[ -e tools/examples/own_allocator_and_tasks.c ] && says own_allocator_and_tasks 'equal hashes'
for c in tools/examples/*.c; do check "$c was built and is tried here" grep -q "says $(basename "$c" .c) " tests/cli/test_examples.sh; done
echo "$passed passed, $failed failed, 0 skipped"
[ $failed -eq 0 ]
