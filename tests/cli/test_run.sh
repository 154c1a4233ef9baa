#!/bin/bash
# The command as a user runs it: run, log info, play over memq, render; equal hashes; Ctrl-C; help.
set -u
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
jostle=$(pwd)/$BUILD/bin/jostle
double=$(pwd)/$BUILD/bin/jostle-f64
scene=$(pwd)/tools/scenes/showcase.json
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
passed=0
failed=0
check() {
    name=$1
    shift
    if "$@" >out 2>&1; then passed=$((passed + 1)); else
        failed=$((failed + 1))
        echo "FAILED $name"
        tail -5 out | sed 's/^/  /'
    fi
}
field() { python3 -c "import json,sys; d=json.load(open(sys.argv[1]))
for k in sys.argv[2].split('.'): d=d[k]
print(d)" "$1" "$2"; }

# One short run of the mixed world a worker count; the state must not depend on it, nor on a second run.
for w in 1 2 4; do "$jostle" run "$scene" --seconds 1 --workers $w --json >run$w.json || failed=$((failed + 1)); done
"$jostle" run "$scene" --seconds 1 --json --log run.lcmlog >again.json || failed=$((failed + 1))
h=$(field run1.json state_hash)
check "the hash is one" test -n "$h"
check "2 workers give the same hash" test "$h" = "$(field run2.json state_hash)"
check "4 workers give the same hash" test "$h" = "$(field run4.json state_hash)"
check "a second run, logged, gives the same hash" test "$h" = "$(field again.json state_hash)"
check "another seed gives another hash" test "$h" != "$("$jostle" run "$scene" --seconds 1 --seed 8 --json | tee s.json >/dev/null; field s.json state_hash)"
check "--set changes the run" test "$h" != "$("$jostle" run "$scene" --seconds 1 --set world.substeps=2 --json | tee s.json >/dev/null; field s.json state_hash)"
for isa in scalar sse avx2 avx512; do
    JSL_ISA=$isa "$jostle" run "$scene" --seconds 1 --json >isa.json
    check "JSL_ISA=$isa gives the same hash" test "$h" = "$(field isa.json state_hash)"
done
check "boids" test "$(field run1.json entities.boids)" = 400
check "bodies" test "$(field run1.json entities.bodies)" = 61
check "sixty steps" test "$(field run1.json steps)" = 60
check "nothing was dropped" test "$(field again.json log.frames_dropped)" = 0
check "every frame offered is accounted for" test "$(field again.json log.frames_offered)" = \
    "$(($(field again.json log.frames_sent) + $(field again.json log.frames_decimated) + $(field again.json log.frames_dropped)))"
check "the double build runs" "$double" run "$scene" --seconds 0.1 --quiet

check "log info is happy" "$jostle" log info run.lcmlog
"$jostle" log info run.lcmlog --json >info.json
check "the log was closed" test "$(field info.json closed)" = True
check "no damage" test "$(field info.json holes)" = 0
check "body frames at 60 Hz" test "$(field info.json body_frames)" -ge 60
check "the file is as long as the run said" test "$(stat -c %s run.lcmlog)" = "$(field again.json log.bytes)"
head -c 100000 run.lcmlog >cut.lcmlog
"$jostle" log info cut.lcmlog >out 2>&1
check "a truncated log is told of" test $? -eq 1

check "play into memq" "$jostle" play run.lcmlog --lcm memq:// --speed 0 --quiet
check "render pictures" "$jostle" render run.lcmlog -o 'p_%02d.png' --width 160 --height 90 --fps 4 --quiet
check "five pictures" test "$(ls p_*.png | wc -l)" = 5
check "no picture is empty" test "$(find . -name 'p_*.png' -size -1k | wc -l)" = 0
check "render a contact sheet" "$jostle" render run.lcmlog --sheet sheet.png --width 160 --height 90 --fps 12 --quiet
if command -v ffmpeg >/dev/null; then check "render a video" "$jostle" render run.lcmlog -o v.mp4 --width 160 --height 90 --fps 5 --quiet; fi
check "a picture needs a pattern" test "$("$jostle" render run.lcmlog -o 'x_%s.png' 2>/dev/null; echo $?)" = 2

# The first picture is the first instant.
"$jostle" render run.lcmlog -o 'first_%d.png' --to 0 --width 640 --height 360 --quiet
"$jostle" run "$scene" --seconds 0.5 --log late.lcmlog --quiet
"$jostle" render late.lcmlog -o 'late_%d.png' --to 0.1 --fps 60 --width 640 --height 360 --quiet
check "the picture at 0 s shows step 0" cmp first_0.png late_0.png
check "the picture one step later is another" bash -c '! cmp -s late_0.png late_1.png'

# Nothing that was there is lost.
cp run.lcmlog same.lcmlog
check "export refuses to replace the log" test "$("$jostle" log export same.lcmlog --channel bodies --format csv -o same.lcmlog 2>/dev/null; echo $?)" = 2
check "render refuses to replace the log" test "$("$jostle" render same.lcmlog --sheet same.lcmlog 2>/dev/null; echo $?)" = 2
check "the log is still there" cmp run.lcmlog same.lcmlog
cp "$scene" own.json
check "run refuses to replace the scene" test "$("$jostle" run own.json --log own.json 2>/dev/null; echo $?)" = 2
check "the scene is still there" cmp "$scene" own.json
echo precious >precious.mp4
timeout --foreground -s INT 1 "$jostle" render run.lcmlog -o precious.mp4 --quiet 2>/dev/null
check "a video that was there survives a render that is stopped" grep -q precious precious.mp4
check "and no part of the new one is left" test ! -e precious.part.mp4

mkfifo pipe
(timeout 5 cat pipe >/dev/null &)
timeout 5 "$jostle" log export run.lcmlog --channel bodies --format csv -o pipe >/dev/null 2>&1
check "a pipe is written, not replaced" test -p pipe
check "a sheet does not replace a pipe" test "$("$jostle" render run.lcmlog --sheet pipe --to 0 --width 64 --height 36 --quiet 2>/dev/null; echo $?)" = 1
check "the pipe is still there" test -p pipe

# Damage does not pass as sound.
cp run.lcmlog damaged.lcmlog
printf 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx' | dd of=damaged.lcmlog bs=1 seek=$(($(stat -c %s run.lcmlog) / 2)) conv=notrunc 2>/dev/null
check "log info tells of damaged bytes" test "$("$jostle" log info damaged.lcmlog >/dev/null 2>&1; echo $?)" = 1
echo nonsense >nonsense.lcmlog
check "play refuses what is no log" test "$("$jostle" play nonsense.lcmlog --lcm memq:// 2>/dev/null; echo $?)" = 2
"$jostle" run "$scene" --seconds 0 --json >zero.json
check "no step changes no energy" test "$(field zero.json energy.drift_rel)" = 0.0

# Ctrl-C ends the run properly: summary, closed log.
"$jostle" run "$scene" --seconds 100000 --log int.lcmlog >int.txt 2>&1 &
pid=$!
sleep 1.5
kill -INT $pid
wait $pid
check "Ctrl-C ends with status 0" test $? -eq 0
check "Ctrl-C closes the log" "$jostle" log info int.lcmlog
check "Ctrl-C prints the summary" grep -q 'state hash' int.txt

for c in run log play render bench schema; do check "jostle $c --help" "$jostle" $c --help; done
"$jostle" run --help >help.txt
check "help has an example" grep -q '^example:' help.txt
check "the schema is JSON" bash -c "'$jostle' schema | python3 -m json.tool"
check "--version" "$jostle" --version
echo "$passed passed, $failed failed, 0 skipped"
[ $failed -eq 0 ]
