#!/bin/bash
# At `strict` every OpenCL implementation gives the same bits: pictures and traces of a scene with every shape, every
# light, highlights and checkers, at 1 and 4 lanes. What is not here is skipped, and said so. INTEL_OPENCL_RT names a
# folder that holds Intel's CPU runtime (libintelocl.so, from the package intel-opencl-rt of PyPI, for one).
. "$(dirname "$0")/support.bash"

scene=tests/scenes/every_shape.yaml
width=48 height=27

# Rays from all around at the scene's middle, with zeros of either sign among the directions.
awk 'BEGIN {
    for (i = 0; i < 512; i++) {
        a = i * 2.399963; y = 1 - (2 * i + 1) / 512; r = sqrt(1 - y * y); far = 3 + i % 7 * 4
        x = cos(a) * r; z = sin(a) * r
        printf "%.9g %.9g %.9g %.9g %.9g %.9g\n", x * far, 1 + y * far, z * far, -x + .05 * sin(i), -y + .04 * cos(i), -z
    }
    for (i = 0; i < 64; i++) printf "%.9g 0.5 -20 %s 0 1\n", i * .2 - 6.4, i % 2 ? "0" : "-0"
    for (i = 0; i < 64; i++) printf "%.9g 20 %.9g 0 -1 -0\n", i * .2 - 6.4, sin(i) * 3
}' >"$scratch/rays"

# shoot NAME LANES COMMAND…: NAME.LANES.npy and .csv by this way of running glint.
shoot() {
    local name=$scratch/$1.$2 lanes=$2
    shift 2
    "$@" render $scene --size ${width}x$height --precision strict --lanes "$lanes" --quiet -o "$name.npy" &&
        "$@" trace $scene --rays "$scratch/rays" --precision strict --lanes "$lanes" -o "$name.csv"
}

compare() {
    local name=$1
    shift
    for lanes in 1 4; do
        if ! shoot "$name" $lanes "$@" >"$scratch/log" 2>&1; then
            fail "$name at $lanes lanes: glint failed"
            tail -5 "$scratch/log"
            continue
        fi
        check "$name at $lanes lanes: the picture is not PoCL's at 1" \
            npy_same "$scratch/$name.$lanes.npy" "$scratch/pocl.1.npy" $width
        check "$name at $lanes lanes: the traces are not PoCL's at 1" diff "$scratch/$name.$lanes.csv" "$scratch/pocl.1.csv"
    done
}

has_device() { "$@" devices 2>/dev/null | grep -q '^[0-9]'; }
only_icd() { env OCL_ICD_VENDORS="$1" "${@:2}"; }
named_icd() { find /etc/OpenCL/vendors -name "*$1*.icd" 2>/dev/null | head -1; }

pocl=$(named_icd pocl)
[ "$pocl" ] && has_device only_icd "$pocl" "$GLINT" || skip_all "PoCL is not here to compare with"
shoot pocl 1 only_icd "$pocl" "$GLINT" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
hits=$(grep -c '^[0-9]' "$scratch/pocl.1.csv")
check "the rays hit and miss ($hits hits)" test "$hits" -gt 200 -a "$hits" -lt 640
compare pocl only_icd "$pocl" "$GLINT"

if is_sanitized; then
    echo "skipped: the other implementations, in a sanitized build"
    finish
fi

if command -v oclgrind >/dev/null && has_device oclgrind "$GLINT"; then
    compare oclgrind oclgrind "$GLINT"
else
    echo "skipped: Oclgrind is not here"
fi

export RUSTICL_ENABLE=llvmpipe
rusticl=$(named_icd rusticl)
if [ "$rusticl" ] && has_device only_icd "$rusticl" "$GLINT"; then
    compare rusticl only_icd "$rusticl" "$GLINT"
else
    echo "skipped: rusticl with llvmpipe is not here"
fi

intel=$([ -z "${INTEL_OPENCL_RT-}" ] || find "$INTEL_OPENCL_RT" -name 'libintelocl.so*' 2>/dev/null | sort | head -1)
if [ "$intel" ] && echo "$intel" >"$scratch/intel.icd" && has_device only_icd "$scratch/intel.icd" "$GLINT"; then
    compare intel only_icd "$scratch/intel.icd" "$GLINT"
else
    echo "skipped: Intel's CPU runtime is not here (INTEL_OPENCL_RT names its folder)"
fi
finish
