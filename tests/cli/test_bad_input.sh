#!/bin/bash
# The command refuses bad input: one clear line on stderr, exit status 2, nothing left behind.
set -u
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
jostle=$(pwd)/$BUILD/bin/jostle
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
passed=0
failed=0

good='{"name":"t","seconds":0.1,"bodies":[{"shape":{"sphere":0.5},"position":[0,0,5]}]}'

# refuse NAME PATTERN SCENE-TEXT [ARGUMENTS...]: what stderr says must match; stdout is empty; only the scene file exists.
refuse() {
    name=$1
    pattern=$2
    printf '%s' "$3" >"$work/scene.json"
    shift 3
    (cd "$work" && "$jostle" run scene.json --log out.lcmlog "$@" >stdout 2>stderr)
    code=$?
    lines=$(wc -l <"$work/stderr")
    problem=""
    [ $code -eq 2 ] || problem="exit status $code"
    [ "$lines" -eq 1 ] || problem="$problem, $lines lines on stderr"
    grep -qE "$pattern" "$work/stderr" || problem="$problem, stderr does not match /$pattern/"
    [ -s "$work/stdout" ] && problem="$problem, something on stdout"
    left=$(cd "$work" && ls | grep -vE '^(scene.json|stdout|stderr)$')
    [ -z "$left" ] || problem="$problem, left behind: $left"
    if [ -z "$problem" ]; then passed=$((passed + 1)); else
        failed=$((failed + 1))
        echo "FAILED $name: ${problem#, }"
        sed 's/^/  stderr: /' "$work/stderr"
    fi
    rm -f "$work"/*
}

refuse "broken JSON" 'scene\.json:1:[0-9]+: ' '{"name": '
refuse "duplicate key" 'scene\.json:1:' '{"name":"a","name":"b"}'
refuse "unknown key" 'scene\.json:2:1: gravty: unknown key in scene' '{
"gravty":[0,0,-9.81]}'
refuse "unknown key, nearest named" 'scene\.json:1:11: world\.gravty: .*nearest known one is "gravity"' '{"world":{"gravty":[0,0,-9]}}'
refuse "NaN" 'scene\.json:1:' '{"seconds":NaN}'
refuse "overflow" 'scene\.json:1:' '{"seconds":1e999}'
refuse "negative mass" 'scene\.json:1:[0-9]+: bodies\.0\.mass: .*-1' '{"bodies":[{"shape":{"sphere":1},"mass":-1}]}'
refuse "zero mass" 'bodies\.0\.mass' '{"bodies":[{"shape":{"sphere":1},"mass":0}]}'
refuse "dt 0" 'world\.dt: is 0' '{"world":{"dt":0}}'
refuse "dt -1" 'world\.dt: is -1' '{"world":{"dt":-1}}'
refuse "dt 0 as an option" 'dt' "$good" --dt 0
refuse "dt -1 as an option" 'dt' "$good" --dt -1
refuse "dt nan as an option" 'dt nan: must be finite' "$good" --dt nan
refuse "negative seconds" 'seconds' "$good" --seconds -1
refuse "unknown option" 'unknown option --sceonds' "$good" --sceonds 1
refuse "workers 0" 'workers' "$good" --workers 0
refuse "NaN by --set" 'position' "$good" --set 'bodies.0.position=[0,0,NaN]'
refuse "--set of no place" 'no such place' "$good" --set 'bodies.7.mass=1'
refuse "--set without =" 'KEY=VALUE' "$good" --set 'world.dt'
refuse "no shape" 'bodies\.0: a body needs a "shape"' '{"bodies":[{"mass":1}]}'
refuse "two shapes" 'exactly one of' '{"bodies":[{"shape":{"sphere":1,"box":[1,1,1]}}]}'
refuse "unknown shape" 'unknown key in shape.*"sphere"' '{"bodies":[{"shape":{"spere":1}}]}'
refuse "unknown material" 'no material "ston"; there is stone' '{"materials":{"stone":{}},"bodies":[{"shape":{"sphere":1},"material":"ston"}]}'
refuse "bad colour" 'colour' '{"bodies":[{"shape":{"sphere":1},"color":"red"}]}'
refuse "moving plane" 'bodies\.0' '{"bodies":[{"shape":{"plane":true}}]}'
refuse "unknown emitter mode" 'nearest known one is "poisson"' '{"emitters":[{"mode":"poison"}]}'
refuse "negative rate" 'emitters\.0\.rate' '{"emitters":[{"rate":-5}]}'
refuse "leader without boids" 'no boid' '{"flocks":[{"leader":{"speed":1,"path":[[0,0,0],[1,0,0],[0,1,0]]}}]}'
refuse "short path" 'flocks\.0\.leader' '{"flocks":[{"boids":{"count":1},"leader":{"path":[[0,0,0]]}}]}'
refuse "a list where an object belongs" 'world' '{"world":[]}'
refuse "unwritable log" 'no/such/place' "$good" --log /no/such/place/x.lcmlog
refuse "bad URL" 'nonsense' "$good" --lcm 'nonsense://'

# A missing file, and no file at all.
(cd "$work" && "$jostle" run missing.json >stdout 2>stderr)
[ $? -eq 2 ] && [ "$(wc -l <"$work/stderr")" -eq 1 ] && grep -q 'missing.json: cannot be opened' "$work/stderr" && passed=$((passed + 1)) || {
    failed=$((failed + 1))
    echo "FAILED missing file"
}
for arguments in "run" "nonsense" "log" "log info /no/such/file" "play /no/such/file" "render /no/such/file -o x.mp4" "bench nonsense" ""; do
    # shellcheck disable=SC2086
    (cd "$work" && "$jostle" $arguments >stdout 2>stderr)
    if [ $? -eq 2 ] && [ -s "$work/stderr" ]; then passed=$((passed + 1)); else
        failed=$((failed + 1))
        echo "FAILED jostle $arguments: should end with status 2 and a word on stderr"
    fi
done
echo "$passed passed, $failed failed, 0 skipped"
[ $failed -eq 0 ]
