#!/bin/bash
# Stock LCM tools and ours on the same messages. All traffic stays in a private network namespace without any
# interface but its own loopback: lcm-logger records what lcm-logplayer and jsl_log_play send of our log, byte for byte; lcm-logger
# records our live stream; Python's lcm reads our log.
set -u
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
case $BUILD in /*) ;; *) BUILD=$(pwd)/$BUILD ;; esac
tool=$BUILD/test/f32/interop/tool_lcm
schema=$(pwd)/lcmtypes/jostle.lcm
passed=0
failed=0
skipped=0

check() {
    local name=$1
    shift
    if "$@" >"$work/out" 2>&1; then passed=$((passed + 1)); else
        failed=$((failed + 1))
        echo "FAILED $name"
        tail -12 "$work/out" | sed 's/^/  /'
    fi
}
skip() {
    echo "skipped: $1"
    skipped=$((skipped + $2))
}
finish() {
    echo "$passed passed, $failed failed, $skipped skipped"
    [ $failed -eq 0 ] && exit 0
    exit 1
}

# -- Inside the namespace: the script calls itself -----------------------------------------------------------
# Starts lcm-logger, runs the rest of the arguments, waits until the log has stopped growing and stops the logger.
record() {
    local file=$1 url=$2
    shift 2
    # lcm-logger 1.3.1 refuses -l, and drops what it has not written when it is interrupted: it is given time to.
    lcm-logger --lcm-url="$url" --flush-interval=20 -f "$file" >"$file.said" 2>&1 &
    local logger=$!
    for _ in $(seq 100); do grep -q "$(printf '%X' 7667)" /proc/net/udp && break; sleep 0.05; done
    sleep 0.2
    "$@" >"$file.sender" 2>&1
    local code=$?
    local before=-1 now=0
    for _ in $(seq 100); do
        now=$(stat -c %s "$file" 2>/dev/null || echo 0)
        [ "$now" = "$before" ] && break
        before=$now
        sleep 0.4
    done
    kill -INT $logger
    wait $logger
    return $code
}

inside() {
    work=$2
    ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo || exit 77
    local url="udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
    # lcm-logger loses what comes while its 30-message queue is full, which a busy machine makes happen: three attempts.
    for try in 1 2 3; do
        record "$work/stock.log" "$url" lcm-logplayer --lcm-url="$url" --speed=0.5 "$work/ours.log"
        echo $? >"$work/stock.code"
        "$tool" sum "$work/stock.log" | sort | cmp -s - "$work/ours.sum" && break
        echo "attempt $try: lcm-logger lost messages of lcm-logplayer"
    done
    for try in 1 2 3; do
        record "$work/own.log" "$url" "$tool" play "$work/ours.log" "$url" 0.5
        echo $? >"$work/own.code"
        "$tool" sum "$work/own.log" | sort | cmp -s - "$work/ours.sum" && break
        echo "attempt $try: lcm-logger lost messages of jsl_log_play"
    done
    record "$work/live.log" "$url" "$tool" live "$url" 20
    echo $? >"$work/live.code"
    ip route del 224.0.0.0/4 dev lo
    "$tool" play "$work/ours.log" "udpm://239.255.76.67:7667?ttl=0" 0 >"$work/noroute" 2>&1
    echo $? >"$work/noroute.code"
    exit 0
}
if [ "${1:-}" = inside ]; then inside "$@"; fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
check "a log is written" "$tool" write "$work/ours.log" 15
check "it is sound" bash -c "'$tool' frames '$work/ours.log' | grep -qx '61 0 0'"
"$tool" sum "$work/ours.log" | sort >"$work/ours.sum"

# -- lcm-logger, lcm-logplayer -----------------------------------------------------------------------------------
namespace=""
for try in "unshare -rn" "unshare -n"; do $try true 2>/dev/null && namespace=$try && break; done
if ! command -v lcm-logger >/dev/null || ! command -v lcm-logplayer >/dev/null || ! command -v ip >/dev/null; then
    skip "lcm-logger, lcm-logplayer and ip are needed (packages liblcm-bin, iproute2)" 6
elif [ -z "$namespace" ]; then
    skip "this machine allows no private network namespace" 6
else
    $namespace "$0" inside "$work"
    code=$?
    if [ $code = 77 ]; then
        skip "the private network namespace cannot be given a multicast route" 6
    else
        for who in stock own; do
            "$tool" sum "$work/$who.log" | sort >"$work/$who.sum"
            check "$who player: sends" grep -qx 0 "$work/$who.code"
            check "$who player: lcm-logger has the same bytes on every channel" diff "$work/ours.sum" "$work/$who.sum"
        done
        # The live stream has no keyframes; what the sender counted is what lcm-logger has.
        check "lcm-logger records the live stream whole" bash -c "'$tool' frames '$work/live.log' | grep -qx '61 0 0'"
        check "without a multicast route the player fails and names the commands" bash -c \
            "[ \$(cat '$work/noroute.code') = 1 ] && grep -q 'ip link set lo multicast on' '$work/noroute' && grep -q 'ip route add 224.0.0.0/4 dev lo' '$work/noroute'"
    fi
fi

# -- Python ----------------------------------------------------------------------------------------------------------
venv=$BUILD/venv
if ! command -v python3 >/dev/null || ! command -v lcm-gen >/dev/null; then
    skip "python3 and lcm-gen are needed" 1
    finish
fi
if ! "$venv/bin/python" -c 'import lcm, numpy' 2>/dev/null; then
    rm -rf "$venv"
    python3 -m venv "$venv" >"$work/venv" 2>&1 && "$venv/bin/pip" install -q 'lcm>=1.5,<1.6' numpy >>"$work/venv" 2>&1
fi
if ! "$venv/bin/python" -c 'import lcm, numpy' 2>/dev/null; then
    tail -3 "$work/venv" | sed 's/^/  /'
    skip "Python's lcm and numpy cannot be installed here (no network?)" 1
    finish
fi
lcm-gen -p --ppath "$work" "$schema" || exit 1
cat >"$work/read.py" <<'PY'
import sys, collections
import numpy as np
import lcm
sys.path.insert(0, sys.argv[1])
from jostle import state_t, scene_t, body_info_t, schema_t, diag_t, column_t, keyframe_t
counts, size, chunks = collections.Counter(), collections.Counter(), {}
for event in lcm.EventLog(sys.argv[2], "r"):
    counts[event.channel] += 1
    size[event.channel] += len(event.data)
    if event.channel == "JOSTLE_PARTICLES":
        m = state_t.decode(event.data)
        assert m.encode() == event.data, "Python writes other bytes"
        chunks.setdefault(m.step, []).append(m)
    elif event.channel == "JOSTLE_SCENE":
        assert scene_t.decode(event.data).name == "interop"
    elif event.channel == "JOSTLE_SCHEMA":
        s = schema_t.decode(event.data)
        assert s.source == open(sys.argv[3]).read()
        assert dict(zip(s.type_name, s.fingerprint))["state_t"] & (2**64 - 1) == int.from_bytes(state_t._get_packed_fingerprint(), "big")
    elif event.channel == "JOSTLE_BODY_INFO":
        assert body_info_t.decode(event.data).n == 40
    elif event.channel == "JOSTLE_DIAG":
        diag_t.decode(event.data)
    elif event.channel == "JOSTLE_KEYFRAME":
        keyframe_t.decode(event.data)
for line in open(sys.argv[4]):
    name, n, nbytes, _ = line.split()
    assert (counts[name], size[name]) == (int(n), int(nbytes)), name
assert len(counts) == len(open(sys.argv[4]).readlines())
assert len(chunks) >= 30
for step, ms in chunks.items():
    assert len(ms) == ms[0].chunk_count and sum(m.n for m in ms) == 12000
    if step == 0:
        continue
    for m in ms:
        c = m.column[0]
        assert (c.field, c.encoding, c.components) == (column_t.FIELD_POS, column_t.ENC_U16Q, 3)
        codes = np.frombuffer(c.data, "<u2").reshape(3, m.n).astype(float)
        xyz = np.array(c.lo[:3])[:, None] + codes * np.array(c.step[:3])[:, None]
        i = np.arange(m.first, m.first + m.n) + step - 1
        # half a code step over 20 m, and float's rounding
        assert np.abs(xyz[0] - 10 * np.sin(i)).max() < 20 / 131070 * 1.02 + 1e-5
        assert np.abs(xyz[1] - 10 * np.cos(i)).max() < 20 / 131070 * 1.02 + 1e-5
print("ok")
PY
check "Python's EventLog reads every event and lcm-gen's types decode them" "$venv/bin/python" "$work/read.py" "$work" "$work/ours.log" "$schema" "$work/ours.sum"
finish
