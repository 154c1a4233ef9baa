#!/bin/sh
# Reports files over 800 lines and functions over 80; fails over 1000 and 150.
set -eu
cd "$(dirname "$0")/.."
find src include tools tests -name '*.[ch]' -o -name '*.cpp' | sort | xargs awk '
function end_file() { files++; if (last > 800) { print file ": " last " lines"; if (last > 1000) bad = 1 } }
FNR == 1 { if (file != "") end_file(); file = FILENAME; candidate = inside = macro = 0 }
{ last = FNR; skip = macro || /^#/; macro = skip && /\\$/; if (skip) next }
# A column-0 line starts a declaration; it is a function when a brace comes before a semicolon or an equals sign.
!inside && !candidate && /^[A-Za-z_]/ { candidate = FNR; head = "" }
candidate && !inside {
    head = head $0
    if (/;[ \t]*(\/[\/*].*)?$/ || head ~ /=/ || head ~ /^(typedef|struct|enum|union)[^(]*\{/ || head ~ /^extern "C"/) candidate = 0
    else if (/\{[ \t]*$/) { inside = candidate; name = head; candidate = 0 }
    else if (/\}[ \t]*$/) { functions++; candidate = 0 }
}
/^\}/ && inside {
    n = FNR - inside + 1; functions++
    if (n > 80) { print file ":" inside ": function of " n " lines: " substr(name, 1, 60); if (n > 150) bad = 1 }
    inside = 0
}
END { end_file(); print "sizes: " files " files, " functions " functions, " (bad ? "too long" : "ok"); exit bad }'
