#!/bin/bash
# jostle log export as a user runs it; the tables are read with nothing but Python's own library.
set -u
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
jostle=$(pwd)/$BUILD/bin/jostle
double=$(pwd)/$BUILD/bin/jostle-f64
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
# refuse NAME STATUS PATTERN COMMAND...: that exit status, one line on stderr that matches, no table left behind.
refuse() {
    name=$1 want=$2 pattern=$3
    shift 3
    rm -f none.csv none.npz
    "$@" >out 2>err
    code=$?
    check "$name: exit status $want, not $code" test $code -eq "$want"
    check "$name: says why" grep -qE "$pattern" err
    check "$name: in one line" test "$(wc -l <err)" -eq 1
    check "$name: nothing left" test ! -e none.csv -a ! -e none.npz
}

cat >scene.json <<'S'
{"name": "falling", "seconds": 1, "world": {"gravity": [0, 0, -10]},
 "publish": {"components": ["velocity", "body"], "components_hz": 30, "bodies_hz": 60},
 "bodies": [{"shape": {"sphere": 0.5}, "position": [1, 2, 100]}, {"shape": {"box": [1, 1, 1]}, "position": [5, 2, 100]}]}
S
cat >read.py <<'P'
import struct, zipfile
def npz(path):
    z = zipfile.ZipFile(path)
    assert z.testzip() is None
    out = {}
    for name in z.namelist():
        b = z.read(name)
        assert b[:8] == b"\x93NUMPY\1\0" and len(b[10:]) >= struct.unpack("<H", b[8:10])[0]
        n = struct.unpack("<H", b[8:10])[0]
        assert (10 + n) % 64 == 0
        h = eval(b[10:10 + n])
        assert h["fortran_order"] is False and len(h["shape"]) == 1
        rows, descr, body = h["shape"][0], h["descr"], b[10 + n:]
        if descr[1] == "S":
            k = int(descr[2:])
            assert len(body) == rows * k
            out[name[:-4]] = [body[i * k:i * k + k].rstrip(b"\0").decode() for i in range(rows)]
        else:
            code = {"<f4": "f", "<f8": "d", "<i8": "q", "<u8": "Q", "<u4": "I"}[descr]
            out[name[:-4]] = struct.unpack("<%d%s" % (rows, code), body)
    return out
P
check "a scene's components are published" bash -c "'$jostle' run scene.json --log a.lcmlog --json >run.json"
check "frames add up" python3 -c "
import json; l = json.load(open('run.json'))['log']
assert l['frames_offered'] == 61 * 3 and l['frames_offered'] == l['frames_sent'] + l['frames_decimated'] + l['frames_dropped'], l
assert l['frames_sent'] == 61 + 2 * 31, l"
check "log info counts them" bash -c "'$jostle' log info a.lcmlog --json | python3 -c 'import json,sys; assert json.load(sys.stdin)[\"component_frames\"] == 62'"

check "velocity as csv" "$jostle" log export a.lcmlog --channel velocity --from 0.5 --to 1 --every 3 -o v.csv
check "its header and values" python3 -c "
import csv
rows = list(csv.reader(open('v.csv')))
assert rows[0] == ['step', 'time [s]', 'id', 'vx [m/s]', 'vy [m/s]', 'vz [m/s]'], rows[0]
steps = [int(r[0]) for r in rows[1:]]
assert steps == sorted(2 * [30, 36, 42, 48, 54, 60]), steps
for r in rows[1:]:
    t, vz = float(r[1]), float(r[5])
    assert abs(t - int(r[0]) / 60) < 1e-6 and abs(vz + 10 * t) < 1e-3 and int(r[2]) > 0, r"
check "bodies as npz" "$jostle" log export a.lcmlog --channel bodies --format npz -o b.zip
check "its arrays" python3 -c "
from read import npz
z = npz('b.zip')
assert z['fields'] == ['px', 'py', 'pz', 'qx', 'qy', 'qz', 'qw', 'vx', 'vy', 'vz', 'wx', 'wy', 'wz', 'rgba'], z['fields']
assert z['units'][:3] == ['m'] * 3 and z['units'][7] == 'm/s' and z['units'][10] == 'rad/s'
assert len(z['step']) == 122 and all(len(z[f]) == 122 for f in z['fields'])
assert set(zip(z['px'], z['py'])) == {(1, 2), (5, 2)} and set(z['qw']) == {1}
for t, z_, v in zip(z['time'], z['pz'], z['vz']): assert abs(v + 10 * t) < 1e-3 and abs(100 - 5 * t * t - z_) < 0.1"
check "csv and npz agree" bash -c "'$jostle' log export a.lcmlog --channel body -o c.csv && '$jostle' log export a.lcmlog --channel body -o c.npz"
check "in every value" python3 -c "
import csv
from read import npz
z, rows = npz('c.npz'), list(csv.reader(open('c.csv')))
names = ['step', 'time', 'id'] + z['fields']
assert [h.split(' [')[0] for h in rows[0]] == names and len(rows) - 1 == len(z['step']) == 62
for i, r in enumerate(rows[1:]):
    for n, v in zip(names, r): assert abs(float(v) - z[n][i]) <= 1e-9 * abs(z[n][i]), (n, v, z[n][i])"
check "the double build writes doubles" bash -c "'$double' run scene.json --log d.lcmlog --quiet && '$jostle' log export d.lcmlog --channel velocity -o d.npz"
check "of the same motion" python3 -c "
from read import npz
z = npz('d.npz')
for t, v in zip(z['time'], z['vz']): assert abs(v + 10 * t) < 1e-7"
check "the same log gives the same file" bash -c "'$jostle' log export a.lcmlog --channel body -o e.npz && cmp c.npz e.npz"

refuse "no such log" 2 'none.lcmlog' "$jostle" log export none.lcmlog -o none.csv
refuse "no such channel" 2 'no velocty, but bodies, .*velocity' "$jostle" log export a.lcmlog --channel velocty -o none.csv
refuse "several channels" 2 'choose a channel: bodies' "$jostle" log export a.lcmlog -o none.csv
refuse "no such format" 2 'csv or npz' "$jostle" log export a.lcmlog --channel body --format xlsx -o none.csv
refuse "no output" 2 '\-o FILE' "$jostle" log export a.lcmlog --channel body
refuse "an empty range" 2 'not before' "$jostle" log export a.lcmlog --channel body --from 2 --to 1 -o none.csv
refuse "an output that cannot be written" 1 'cannot be written' "$jostle" log export a.lcmlog --channel body -o nowhere/none.csv
sed 's/"velocity", "body"/"velocty"/' scene.json >bad.json
refuse "a scene that names no component" 2 'velocty' "$jostle" run bad.json --log none.csv
sed 's/"velocity", "body"/7/' scene.json >bad.json
refuse "a scene whose name is no string" 2 'bad.json:.*publish.components.0.*string' "$jostle" run bad.json --log none.csv
# A byte of the last chunk of columns: that frame is passed over and told of.
python3 -c "
b = bytearray(open('a.lcmlog', 'rb').read())
b[b.rindex(b'JOSTLE_COLUMNS', 0, b.rindex(b'JOSTLE_TELEMETRY')) + 400] ^= 1
open('hurt.lcmlog', 'wb').write(b)"
"$jostle" log export hurt.lcmlog --channel body -o hurt.csv >out 2>&1
check "a damaged frame gives exit status 1" test $? -eq 1
check "and the others are exported" test "$(wc -l <hurt.csv)" -eq 61
echo "$passed passed, $failed failed, 0 skipped"
[ $failed -eq 0 ]
