#!/bin/bash
# The command line as a user meets it: every option, every message about a wrong one, the exit status, what is printed
# where, and that a failure leaves an earlier picture as it was.
. "$(dirname "$0")/support.bash"

cp tests/scenes/every_shape.yaml "$scratch/every.yaml"
cp tests/scenes/complete.rt tests/scenes/complete.cfg "$scratch"
cd "$scratch" || exit 1
cat >ball.yaml <<'E2'
camera: {position: [0, 0, -4], look_at: [0, 0, 0], fov: 60}
background: [0.1, 0.2, 0.4]
lights:
  - point: {position: [3, 4, -5]}
  - directional: {direction: [0, -1, 0.3], color: [0.2, 0.2, 0.2]}
objects:
  - sphere: {center: [0, 0, 0], radius: 1}
E2
sed '/^lights/,/directional/d; s/^back/ambient: [1, 1, 1]\nback/' ball.yaml >unlit.yaml
echo '0 0 -4  0 0 1' >rays
small='--size 8x6 --quiet'

# ok WHAT ARGUMENTS…: exit status 0; stdout and stderr are kept in out and err.
ok() {
    local what=$1
    shift
    "$GLINT" "$@" >out 2>err && pass || { fail "$what: exit status $?"; cat err; }
}
# refused STATUS PATTERN ARGUMENTS…: exit status, the message on stderr, nothing on stdout.
refused() {
    local status=$1 pattern=$2 got
    shift 2
    "$GLINT" "$@" >out 2>err </dev/null
    got=$?
    if [ $got != "$status" ]; then
        fail "glint $*: exit status $got, not $status"
    elif ! grep -qE -- "$pattern" err; then
        fail "glint $*: no message like '$pattern' but: $(cat err)"
    elif [ -s out ]; then
        fail "glint $*: on standard output: $(head -3 out)"
    else
        pass
    fi
}

# python WHAT PROGRAM ARGUMENTS…: python3 with readers of what glint writes.
cat >readers.py <<'E2'
import ast, math, struct, sys, zlib

def npy(path):
    data = open(path, 'rb').read()
    assert data[:8] == b'\x93NUMPY\x01\x00', path
    length, = struct.unpack('<H', data[8:10])
    head = ast.literal_eval(data[10:10 + length].decode())
    assert not head['fortran_order']
    count = math.prod(head['shape'])
    kind = {'<f4': 'f', '<f8': 'd', '<u4': 'I'}[head['descr']]
    values = struct.unpack('<%d%s' % (count, kind), data[10 + length:])
    return head['shape'], head['descr'], values

def png(path):
    data = open(path, 'rb').read()
    assert data[:8] == b'\x89PNG\r\n\x1a\n', path
    at, chunks = 8, []
    while at < len(data):
        size, kind = struct.unpack('>I4s', data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        assert struct.unpack('>I', data[at + 8 + size:at + 12 + size])[0] == zlib.crc32(kind + body)
        chunks.append((kind, body))
        at += 12 + size
    assert chunks[-1][0] == b'IEND'
    width, height, bits, color = struct.unpack('>IIBB', chunks[0][1][:10])
    pixels = zlib.decompress(b''.join(body for kind, body in chunks if kind == b'IDAT'))
    texts = dict(body.split(b'\0', 1) for kind, body in chunks if kind == b'tEXt')
    return (width, height, bits, color), pixels, texts, [kind for kind, _ in chunks]

def csv(path):
    return [line.split(',') for line in open(path).read().split('\n')[:-1]]
E2
python() { check "$1" env PYTHONDONTWRITEBYTECODE=1 python3 -c "from readers import *; $2"; }

# Commands.
refused 1 'usage: glint COMMAND'
ok 'glint --help' --help && check 'help on standard output' grep -q '^usage: glint' out
ok 'glint help' help
ok 'glint --version' --version && check 'the version' grep -qE '^glint [0-9]+\.[0-9]+' out
for command in render trace check devices; do
    ok "glint $command --help" $command --help && check "help of $command" grep -q "^usage: glint $command" out
done
refused 1 'no command "rendr"; did you mean render\?' rendr ball.yaml
refused 1 'no command "zzzzzz"$' zzzzzz
for command in render trace check; do
    refused 1 "glint $command: which scene\?.*--help" $command
    refused 1 "glint $command: one scene at a time" $command ball.yaml every.yaml
    refused 1 "unrecognized option '--nonsense'" $command ball.yaml --nonsense
done
refused 1 "unrecognized option '--nonsense'" devices --nonsense
refused 1 'which rays\?' trace ball.yaml
refused 1 "requires an argument" render ball.yaml --size

# Values of options.
for value in 0x5 5x0 5 5x 5x5x5 -5x5 1048577x4 99999999999x4 wide; do
    refused 1 '--size: expected WIDTHxHEIGHT' render ball.yaml --size $value
done
for value in 0 -1 1.5 many 1048577 99999999999999999999; do
    refused 1 '--samples: expected a whole number from 1 to' render ball.yaml --samples $value
done
for value in 1,2,3 1,2,3,4,5 1,2,0,4 1,2,3,0 -1,0,2,2 a,b,c,d 1,2,3,4x 9999999999,0,1,1; do
    refused 1 '--region: expected X,Y,WIDTH,HEIGHT' render ball.yaml --region $value
done
for value in 0,0,9,1 0,0,1,7 8,0,1,1 0,6,1,1 99999,0,1,1; do
    refused 1 "--region: .* does not lie within the picture of 8x6" render ball.yaml --size 8x6 --region $value
done
refused 1 '--bits: expected 8 or 16, not "12"' render ball.yaml --bits 12
refused 1 '--transfer: expected srgb or none, not "srbg"; did you mean srgb\?' render ball.yaml --transfer srbg
refused 1 '--timing: expected text or json, not "jsn"; did you mean json\?' render ball.yaml --timing=jsn
refused 1 '--aov: expected names .*, not "nromal"; did you mean normal\?' render ball.yaml --aov t,nromal
refused 1 '--aov: expected names' render ball.yaml --aov t,
refused 1 '--aov: expected names' render ball.yaml --aov ''
for command in 'render ball.yaml' 'trace ball.yaml --rays rays'; do
    refused 1 '--precision: expected .*, not "sinlge"; did you mean single\?' $command --precision sinlge
    refused 1 '--lanes: expected 1, 4, 8 or 16, not "3"' $command --lanes 3
    refused 1 '--lanes: expected' $command --lanes 0
    refused 1 'no usable device is "toaster"; there are: 0 \(' $command --device toaster
    refused 1 'no usable device is "99"; there are: 0 \(' $command --device 99
done
GLINT_DEVICE=toaster refused 1 'no usable device is "toaster"' render ball.yaml
OCL_ICD_VENDORS=$scratch/none.icd refused 1 'no OpenCL device.*pocl-opencl-icd' render ball.yaml

# PoCL has no device where it cannot keep its cache: Debian's, at least.
pocl=$(find /etc/OpenCL/vendors -name '*pocl*.icd' 2>/dev/null | head -1)
if [ "$pocl" ]; then
    if ! XDG_CACHE_HOME=/dev/null OCL_ICD_VENDORS=$pocl "$GLINT" devices >out 2>err; then
        check 'PoCL without a cache' grep -q 'set HOME, XDG_CACHE_HOME or POCL_CACHE_DIR' err
    fi
fi

# Files that are not there or do not fit.
for command in render check 'trace --rays rays'; do
    refused 1 "missing.yaml.*No such file" $command missing.yaml
    refused 1 'ball.txt' $command ball.txt
done
refused 1 'no-rays.*No such file' trace ball.yaml --rays no-rays
printf '0 0 -4 0 0 1\n0 0 -4 0 x 1\n' >bad-rays
refused 1 '^bad-rays:2:10: error: expected a number' trace ball.yaml --rays bad-rays
echo '0 0 -4 0 0 1 0' >bad-rays && refused 1 '^bad-rays:1:1: error: expected .*found 7' trace ball.yaml --rays bad-rays
echo '0 0 -4 0 0 1 0 1 2' >bad-rays && refused 1 'found more' trace ball.yaml --rays bad-rays
echo '0 0 -4 0 0 inf' >bad-rays && refused 1 'beyond the precision' trace ball.yaml --rays bad-rays
echo '0 0 -4 0 0 1e-50' >bad-rays && refused 1 'direction cannot be 0 0 0' trace ball.yaml --rays bad-rays
seq 100000 >bad-rays && refused 1 '^bad-rays:1:1: error: expected .*found 1$' trace ball.yaml --rays bad-rays
check '20 errors and no more' test "$(grep -c 'bad-rays:[0-9]' err)" = 20
check 'and that there are more' grep -q 'bad-rays: many errors: reading stopped' err
echo '0 0 -4 0 -0 0' >bad-rays && refused 1 'direction cannot be 0 0 0' trace ball.yaml --rays bad-rays
sed 's/position: \[3, 4, -5\]/position: [3e20, 4, -5]/' ball.yaml >far-light.yaml
refused 1 'a light lies 3e.20 from the eye' render far-light.yaml $small -o far-light.png
printf '0 0 -4 0 0 1e20\n0 0 -4 0 0 1e-20\n0 0 -4 0 0 3e38 0 3e-38\n0 0 -4 0 0 1\n' >lengths
"$GLINT" trace ball.yaml --rays lengths >lengths.csv
check 'directions of any length' awk -F, 'NR > 1 && ($1 != 0 || $5 != -1) { bad = 1 } END { exit bad || NR != 5 }' lengths.csv
echo 'camera: 5' >bad.yaml && refused 1 '^bad.yaml:1:' check bad.yaml
echo 'bogus 1' >bad.rt && refused 1 '^Error$' check bad.rt
for ending in jpg PNGX ''; do refused 1 'must end in .png, .ppm, .exr or .npy' render ball.yaml -o "picture.$ending"; done
refused 1 "nowhere/picture.png" render ball.yaml $small -o nowhere/picture.png
sed 's/position: \[3, 4, -5\]/&, color: [1e20, 1, 1], intensity: 1e20/' ball.yaml >huge.yaml
refused 1 'does not fit precision single' render huge.yaml $small -o huge.png
check 'nothing was written for it' test ! -e huge.png

# A failure leaves an earlier picture as it was.
untouched() {
    local what=$1 status=$2
    shift 2
    echo 'an earlier picture' >old.png
    "$GLINT" render "$@" -o old.png >out 2>err </dev/null
    [ $? = "$status" ] && pass || fail "$what: exit status, $(cat err)"
    check "$what: the earlier picture" test "$(cat old.png)" = 'an earlier picture'
    check "$what: nothing left beside it" test -z "$(find . -name '.*.??????')"
}
untouched 'a bad scene' 1 bad.yaml
untouched 'a bad option' 1 ball.yaml --bits 9
untouched 'a bad region' 1 ball.yaml --size 8x6 --region 0,0,9,9
untouched 'no device' 1 ball.yaml --device toaster
if [ "$(id -u)" != 0 ]; then
    chmod a-w old.png && refused 1 'old.png' render ball.yaml $small -o old.png
    chmod u+w old.png
fi
[ ! -c /dev/full ] || { ln -s /dev/full full.png && refused 1 'cannot write' render ball.yaml $small -o full.png; }

if [ -c /dev/full ]; then
    ln -s /dev/full old.t.npy
    untouched 'a file beside it on a full disk' 1 ball.yaml $small --aov t
    rm old.t.npy
    "$GLINT" trace ball.yaml --rays rays >/dev/full 2>err
    check 'a full disk behind standard output: exit status' test $? = 2
    check 'and one message' test "$(wc -l <err)" = 1
fi
if (ulimit -f 1024) 2>/dev/null; then
    "$GLINT" render ball.yaml --size 1000x1000 -o warm.png --quiet 2>err # so that the kernel is built
    (ulimit -f 1024 && env --default-signal=XFSZ "$GLINT" render ball.yaml --size 1000x1000 -o limit.ppm --quiet 2>err)
    check 'a limit on the size of files: exit status' test $? = 1
    check 'its message' grep -q "cannot write '.*limit.ppm': File too large" err
    check 'nothing left of it' test -z "$(find . -name '*limit*')"
fi

# Who reads goes away: no signal ends glint half way.
"$GLINT" check ball.yaml 2>err | :
case ${PIPESTATUS[0]} in 0 | 2) pass ;; *) fail 'nobody reads the standard output' ;; esac
seq -f '%g 0 -4 0 0 1' 100000 >many-rays
"$GLINT" trace ball.yaml --rays many-rays 2>err | head -1 >out
check 'head after trace: exit status' test "${PIPESTATUS[0]}" = 2
check 'its message' test "$(cat err)" = 'glint: cannot write the standard output: Broken pipe'
mkfifo pipe.ppm
head -c 10 pipe.ppm >out &
"$GLINT" render ball.yaml --size 400x300 --quiet --aov t -o pipe.ppm 2>err
check 'a pipe that nobody reads: exit status' test $? = 1
wait
check 'its message' grep -q "cannot write '.*pipe.ppm': Broken pipe" err
check 'nothing left beside it' test -z "$(find . -name '*pipe.t*')"

# A scene's own files are not overwritten, by whatever name.
printf 'P3 1 1 255 9 9 9\n' >globe.png
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >mesh.obj
sed 's/radius: 1}/radius: 1, material: {image: globe.png}}\n  - mesh: {file: mesh.obj}/' ball.yaml >globe.yaml
ln -s globe.yaml link.png
ln globe.png hard.t.npy
mkdir globe
refused 1 "would overwrite 'globe.png', which the scene is read from; name another with -o" render globe.yaml $small
refused 1 "would overwrite 'globe/../globe.png'" render globe.yaml $small -o globe/../globe.png
refused 1 "would overwrite 'link.png'" render globe.yaml $small -o link.png
refused 1 "would overwrite 'hard.t.npy'" render globe.yaml $small --aov normal,t -o hard.png
refused 1 "would overwrite 'mesh.obj'" trace globe.yaml --rays rays -o mesh.obj
check 'its picture is as it was' grep -q '^P3' globe.png
check 'its mesh is as it was' grep -q '^v 0' mesh.obj
check 'the scene is as it was' grep -q '^camera' globe.yaml
ok 'another name' render globe.yaml $small -o globe/other.png
rm globe.png hard.t.npy
refused 1 "^globe.yaml:[0-9]+:[0-9]+: error: cannot read 'globe.png': No such file" check globe.yaml

# Signals while a long render runs: started with the default action, which a background job of this shell has not.
cp every.yaml long.yaml
"$GLINT" render every.yaml --size 64x64 -o warm.png --quiet 2>err
cat >interrupt.py <<'E2'
import glob, signal, subprocess, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL) # nohup has it ignored
arguments = [sys.argv[1], 'render', 'long.yaml', '--size', '20000x20000', '--samples', '64', '-o', 'long.png']
render = subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True)
waited = 0
while not glob.glob('.long.png.*') and waited < 120 and render.poll() is None:
    time.sleep(0.1)
    waited += 0.1
assert glob.glob('.long.png.*'), 'it never began to write'
for name in sys.argv[2:]:
    render.send_signal(getattr(signal, name))
    time.sleep(0.01)
said = render.communicate(timeout=120)[1]
print(said)
assert render.returncode == 130, render.returncode
assert 'interrupted' in said and 'long.png' in said
E2
for signals in SIGINT 'SIGINT SIGINT' SIGTERM SIGHUP; do
    echo 'an earlier picture' >long.png
    check "$signals" python3 interrupt.py "$GLINT" $signals
    check "$signals: the earlier picture" test "$(cat long.png)" = 'an earlier picture'
    check "$signals: nothing left beside it" test -z "$(find . -name '.long.png*')"
done

# Pictures in every format, at every precision.
ok 'a picture named after its scene' render ball.yaml $small
python 'its PNG' 'head, pixels, texts, kinds = png("ball.png"); assert head == (8, 6, 8, 2), head
assert len(pixels) == 6 * 25; assert b"sRGB" in kinds, kinds
for key in b"Software Scene Device Driver Precision Lanes Samples Bounces Size Region Transfer Kernel".split(): assert texts[key], key
assert texts[b"Scene"] == b"ball.yaml" and texts[b"Precision"] == b"single" and texts[b"Size"] == b"8x6", texts'
ok '16 bits' render ball.yaml $small --bits 16 --transfer none --samples 3 --region 2,1,4,3 -o deep.png
python 'its PNG' 'head, pixels, texts, kinds = png("deep.png"); assert head == (4, 3, 16, 2), head
assert b"sRGB" not in kinds and texts[b"Samples"] == b"3" and texts[b"Region"] == b"2,1,4,3" and texts[b"Transfer"] == b"none"'
ok 'PPM' render ball.yaml $small -o a.ppm
check 'its head' test "$(head -c 11 a.ppm | tr '\n' ' ')" = 'P6 8 6 255 '
check 'its size' test "$(stat -c %s a.ppm)" = $((11 + 8 * 6 * 3))
ok 'PPM of 16 bits' render ball.yaml $small --bits 16 -o a16.ppm
check 'its size' test "$(stat -c %s a16.ppm)" = $((13 + 8 * 6 * 6))
ok 'EXR' render ball.yaml $small -o a.EXR
check 'its magic number' test "$(od -An -tx1 -N4 a.EXR)" = ' 76 2f 31 01'
for precision in fast single strict double; do
    for lanes in 1 4 8 16; do
        [ $precision = single ] || [ $lanes = 4 ] || continue
        ok "$precision at $lanes lanes" render ball.yaml $small --precision $precision --lanes $lanes -o $precision.npy
    done
done
python 'NPY' 'shape, kind, values = npy("single.npy"); assert shape == (6, 8, 3) and kind == "<f4"
assert abs(values[0] - 0.1) < 1e-7 and max(values) > 0.9
shape, wide, exact = npy("double.npy"); assert wide == "<f8"
assert max(abs(a - b) for a, b in zip(values, exact)) < 1e-5
assert max(abs(a - b) for a, b in zip(npy("fast.npy")[2], exact)) < 1e-3'
ok '--no-cache' render ball.yaml $small --no-cache -o uncached.npy
check 'it changes nothing' cmp uncached.npy single.npy
ok 'a device by index' render ball.yaml $small --device 0 -o indexed.npy
for scene in complete.rt complete.cfg; do
    ok "$scene" render $scene $small -o other.png
    python "$scene has display values" 'assert b"sRGB" not in png("other.png")[3]'
done
echo 'bogus 1 2 3' >>complete.rt
refused 1 'bogus' check complete.rt
ok '--lenient' render complete.rt --lenient $small -o other.png && check 'its warning' grep -q 'warning.*bogus' err

# What lies behind the pixels.
ok '--aov' render ball.yaml $small --aov t,normal,position,object,shadow,ray,path,color -o v.png
python 'AOV files' '
import math
def near(a, b): return abs(a - b) < 1e-4
t, normal, position = npy("v.t.npy"), npy("v.normal.npy"), npy("v.position.npy")
hit, shadow, color = npy("v.object.npy"), npy("v.shadow.npy"), npy("v.color.npy")
assert t[:2] == ((6, 8), "<f4") and normal[:2] == ((6, 8, 3), "<f4") and position[:2] == ((6, 8, 3), "<f8")
assert hit[:2] == ((6, 8), "<u4") and shadow[:2] == ((6, 8, 2), "<u4") and color[:2] == ((6, 8, 3), "<f4"), shadow
assert color[2] == npy("single.npy")[2]
ray, path = npy("v.ray.npy"), npy("v.path.npy")
assert ray[:2] == ((6, 8, 3), "<f4") and path[:2] == ((6, 8), "<u4")
# one object, seen or not: FNV-1a of the word 8 (0 + 1), or of 0
for i in range(48):
    assert path[2][i] == (0x811c9dc5 ^ (8 if hit[2][i] == 0 else 0)) * 0x01000193 % 2**32
    d = ray[2][3 * i:3 * i + 3]
    assert near(math.hypot(*d), 1)
    if hit[2][i] == 0:
        assert all(near(a * t[2][i], b - c) for a, b, c in zip(d, position[2][3 * i:], (0, 0, -4)))
assert 0 < hit[2].count(0) < 48 and hit[2].count(0) + hit[2].count(2**32 - 1) == 48
for i in range(48):
    n, p = normal[2][3 * i:3 * i + 3], position[2][3 * i:3 * i + 3]
    if hit[2][i] == 0:
        assert all(near(a, b) for a, b in zip(n, p)), (n, p)
        assert near(math.hypot(p[0], p[1], p[2] + 4), t[2][i]) and n[2] < 0
        facing = n[0] * (3 - p[0]) + n[1] * (4 - p[1]) + n[2] * (-5 - p[2])
        assert abs(facing) < 1e-3 or shadow[2][2 * i] == (facing < 0), facing
    else:
        assert math.isinf(t[2][i]) and set(n) == {0} and shadow[2][2 * i:2 * i + 2] == (0, 0)'
ok '--aov without lights' render unlit.yaml $small --aov shadow -o u.png
check 'its warning' grep -q 'no shadow masks.*no lights' err
check 'no file of masks' test ! -e u.shadow.npy

# Explicit rays.
printf '# a comment\n\n0 0 -4  0 0 1\n0,5,-4, 0 0 1\n0x0p0 0 -0x1p+2 0 0 0x1p1 0 10 # hexadecimal\n0 0 -4 0 0 1 0 2\n' >rays
ok 'trace' trace ball.yaml --rays rays
python 'its CSV' 'lines = csv("out"); assert lines[0] == ["object", "t", "nx", "ny", "nz"], lines
assert [float(x) for x in lines[1]] == [0, 3, 0, 0, -1] and [float(x) for x in lines[3]] == [0, 1.5, 0, 0, -1], lines
assert lines[2] == lines[4] == [""] * 5 and len(lines) == 5, lines'
ok 'trace to a file, in double, from standard input' trace ball.yaml --rays - -o hits.csv --precision double --lanes 4 <rays
python 'the same' 'assert [float(x) for x in csv("hits.csv")[1]] == [0, 3, 0, 0, -1]'
check 'nothing on standard output' test ! -s out

# A device may take fewer work-items in a group than glint wishes for; of those here only PoCL can be told to.
ok 'groups as wished for' render every.yaml --size 33x21 --quiet --lanes 1 --aov object,path -o whole.npy
ok 'a trace in them' trace every.yaml --rays rays -o whole.csv
for most in 32 16 1; do
    export POCL_MAX_WORK_GROUP_SIZE=$most
    ok "groups of $most" render every.yaml --size 33x21 --quiet --lanes 1 --aov object,path -o few.npy
    ok "a trace in groups of $most" trace every.yaml --rays rays -o few.csv
    unset POCL_MAX_WORK_GROUP_SIZE
    for file in .npy .object.npy .path.npy .csv; do
        check "groups of $most: $file is the same" cmp whole$file few$file
    done
    rm -f few*
done

# Times and facts for programs: JSON alone on standard output.
ok '--timing=json' render ball.yaml $small --timing=json -o j.png
check '--timing=json is JSON' python3 -m json.tool out
python 'what it says' 'import json; d = json.load(open("out")); assert d["schema"] == 2 and len(d["kernel_hash"]) == 16 and d["size"] == [8, 6]
for key in "parse_ms flatten_ms build_ms build_from_cache upload_ms launches read_backs encode_ms".split(): assert key in d, key
assert [l["name"] for l in d["launches"]] == ["render"]'
ok '--timing' render ball.yaml $small --timing -o j.png
check '--timing speaks on standard error' grep -qE '^ +launches +[0-9.]+ ms' err
check 'and only there' test ! -s out
ok 'check' check every.yaml && check 'its counts' grep -qE 'objects +17: 4 sphere, 1 plane, 1 disc, 1 box' out
ok 'check --json' check every.yaml --json
check 'check --json is JSON' python3 -m json.tool out
python 'what it says' 'import json; d = json.load(open("out")); assert d["schema"] == 1 and len(d["features"]) >= 14, d'
ok 'devices' devices && check 'a device' grep -qE '^0\*? ' out
ok 'devices --json' devices --json
check 'devices --json is JSON' python3 -m json.tool out
finish
