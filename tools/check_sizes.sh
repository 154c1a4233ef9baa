#!/bin/sh
# Reports files over 800 lines and functions over 80; fails over 1000 and 150.
set -eu
cd "$(dirname "$0")/.."
find src include tools tests -name '*.[ch]' -o -name '*.cpp' | grep -v '^build/' | sort | xargs awk '
FNR == 1 { if (file != "") check_file(); file = FILENAME; start = 0 }
{ last = FNR }
/^[a-zA-Z_]/ && !/;[ \t]*$/ && !/^(typedef|struct|enum|union|extern|#)/ { if (!start) { start = FNR; name = $0 } }
/^\}/ { if (start) { n = FNR - start + 1; functions++; if (n > 80) { print file ":" start ": function of " n " lines: " substr(name, 1, 60); if (n > 150) bad = 1 } } start = 0 }
/;[ \t]*$/ && start && FNR == start { start = 0 }
function check_file() { files++; if (last > 800) { print file ": " last " lines"; if (last > 1000) bad = 1 } }
END { check_file(); print "sizes: " files " files, " functions " functions" (bad ? ", too long" : ", ok"); exit bad }'
