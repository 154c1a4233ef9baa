#!/bin/sh
# Simulates the showcase, writes its log, tells what is in it, plays it back into pictures and a video.
set -eu
cd "$(dirname "$0")/.."
BUILD=${BUILD:-build}
out=$BUILD/demo
mkdir -p "$out"
rm -f "$out"/showcase.*
jostle=$BUILD/bin/jostle
echo "== simulate"
"$jostle" run tools/scenes/showcase.json --workers "$(nproc)" --log "$out/showcase.lcmlog"
echo "== jostle log info"
"$jostle" log info "$out/showcase.lcmlog"
echo "== play back into pictures"
"$jostle" render "$out/showcase.lcmlog" -o "$out/showcase.mp4" --sheet "$out/showcase.png"
echo "video          $out/showcase.mp4"
echo "contact sheet  $out/showcase.png"
