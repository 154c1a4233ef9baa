#!/bin/sh
# Proves that every file in src/ and include/ includes only its own room and rooms on lower floors, that the core
# includes nothing but libc and pthread, and that no header includes itself by a circle.
set -eu
cd "$(dirname "$0")/.."
find src include -name '*.[ch]' -o -name '*.cpp' | sort | xargs awk '
BEGIN {
    n = split("base 0 math 1 ecs 2 geometry 3 particle 4 flock 4 agent 4 rigid 4 world 5 scene 6 telemetry 6 oracle 6 render 6", t, " ")
    for (i = 1; i <= n; i += 2) floor[t[i]] = t[i + 1]
    # public headers and the room they belong to
    n = split("base base math math wind math ecs ecs components ecs shape geometry particle particle flock flock agent agent body rigid world world frame world scene scene telemetry telemetry oracle oracle render render jostle world", t, " ")
    for (i = 1; i <= n; i += 2) room_of[t[i]] = t[i + 1]
    n = split("assert errno float inttypes limits locale math pthread sched stdarg stdatomic stdbool stddef stdint stdio stdlib string time unistd signal immintrin nmmintrin", t, " ")
    for (i = 1; i <= n; i++) libc[t[i]] = 1
}
FNR == 1 {
    file = FILENAME
    if (file ~ /^include\/jostle\//) { stem = file; sub(/^include\/jostle\//, "", stem); sub(/\.h$/, "", stem); room = room_of[stem] }
    else { split(file, part, "/"); room = part[2] }
    if (!(room in floor)) { print file ": belongs to no room that this script knows"; bad = 1 }
}
/^[ \t]*#[ \t]*include/ {
    line = $0
    sub(/^[ \t]*#[ \t]*include[ \t]*/, "", line)
    open = substr(line, 1, 1); name = substr(line, 2); sub(/[">].*/, "", name)
    if (name ~ /^jostle\//) {
        stem = name; sub(/^jostle\//, "", stem); sub(/\.h$/, "", stem)
        other = room_of[stem]
        if (file != "include/jostle/jostle.h" && other == "") { print file ": includes unknown <" name ">"; bad = 1; next }
    } else if (open == "\"") {
        split(name, part, "/"); other = (name ~ /\//) ? part[1] : room
        if (!(other in floor)) { other = room }
    } else {
        stem = name; sub(/\.h$/, "", stem)
        # madvise of the C library: for the default allocator alone, which asks for huge pages
        if (stem == "sys/mman" && file == "src/base/alloc.c") next
        if (stem == "sys/stat" && file == "src/world/clone.c") next
        if (floor[room] <= 5 && !(stem in libc)) { print file ": the core may not include <" name ">"; bad = 1 }
        next
    }
    if (file == "include/jostle/jostle.h") next
    if (other != room && floor[other] >= floor[room]) {
        print file ": room " room " (floor " floor[room] ") includes " name " of room " other " (floor " floor[other] ")"; bad = 1
    }
    if (file ~ /\.h$/) { to = name; if (name ~ /^jostle\//) to = "include/" name; else if (name ~ /\//) to = "src/" name; else { dir = file; sub(/[^\/]*$/, "", dir); to = dir name }
        print file, to > "/dev/stderr" }
}
END { exit bad }' 2>"${TMPDIR:-/tmp}/jostle-floors.$$" || { rm -f "${TMPDIR:-/tmp}/jostle-floors.$$"; exit 1; }
circles=$(tsort "${TMPDIR:-/tmp}/jostle-floors.$$" 2>&1 >/dev/null || true)
rm -f "${TMPDIR:-/tmp}/jostle-floors.$$"
if [ -n "$circles" ]; then echo "headers include each other in a circle:"; echo "$circles"; exit 1; fi
if grep -rnw 'jsl_world' src/base src/math src/ecs src/geometry src/particle src/flock src/rigid --include='*.[ch]' 2>/dev/null | grep -v 'struct jsl_world;' | grep -vE '^[^:]*:[0-9]*:[ \t]*(/?\*|//)' | grep -E 'jsl_world[ ]*\*|jsl_world_' ; then
    echo "a room below floor 5 names jsl_world"; exit 1
fi
echo "floors: ok"
