#!/bin/bash
# At `strict` every OpenCL implementation gives the same bits: pictures and traces of a scene with every shape, every
# light, highlights and checkers, at 1 and 4 lanes. What is not here is skipped, and said so. INTEL_OPENCL_RT names a
# folder that holds Intel's CPU runtime (libintelocl.so, from the package intel-opencl-rt of PyPI, for one).
#
# rusticl on llvmpipe (Mesa 22.3) has no fused multiply-add, and its compiler inlines the one that the kernels have in its
# place everywhere. There the scene is taken apart, one kind of shape at a time under all lights, a few seconds each; whole
# at 1 lane, which takes the compiler 17 seconds and 1.8 GB, with GLINT_LONG_TESTS=1.
. "$(dirname "$0")/support.bash"

scene=tests/scenes/every_shape.yaml
width=32 height=18

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

# picture NAME LANES SCENE COMMAND…: NAME.LANES.npy by this way of running glint; trace: NAME.LANES.csv.
picture() {
    "${@:4}" render "$3" --size ${width}x$height --precision strict --lanes "$2" --quiet -o "$scratch/$1.$2.npy"
}
trace() {
    "${@:4}" trace "$3" --rays "$scratch/rays" --precision strict --lanes "$2" -o "$scratch/$1.$2.csv"
}
shoot() { picture "$1" "$2" $scene "${@:3}" && trace "$1" "$2" $scene "${@:3}"; }

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

# compare_apart NAME SHAPE COMMAND…: the scene with one kind of shape only, or all, a picture at 1 lane, against PoCL's.
compare_apart() {
    local name=$1 shape=$2
    awk -v kept="$shape:" '/^objects/ { inside = 1; print; next } !inside || kept == "all:" || $2 == kept' \
        $scene >"$scratch/$shape.yaml"
    picture "pocl-$shape" 1 "$scratch/$shape.yaml" only_icd "$pocl" "$GLINT" >"$scratch/log" 2>&1 &&
        picture "$name-$shape" 1 "$scratch/$shape.yaml" "${@:3}" >>"$scratch/log" 2>&1 || {
        fail "$name, $shape: glint failed"
        tail -5 "$scratch/log"
        return
    }
    check "$name, $shape: the picture is not PoCL's" \
        npy_same "$scratch/$name-$shape.1.npy" "$scratch/pocl-$shape.1.npy" $width
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
    # optimised, LLVM leaves in calls that Oclgrind 21.10 does not know
    compare oclgrind oclgrind --build-options -cl-opt-disable "$GLINT"
else
    echo "skipped: Oclgrind is not here"
fi

intel=$([ -z "${INTEL_OPENCL_RT-}" ] || find "$INTEL_OPENCL_RT" -name libintelocl.so 2>/dev/null | head -1)
if [ "$intel" ] && echo "$intel" >"$scratch/intel.icd" && has_device only_icd "$scratch/intel.icd" "$GLINT"; then
    compare intel only_icd "$scratch/intel.icd" "$GLINT"
else
    echo "skipped: Intel's CPU runtime is not here (INTEL_OPENCL_RT names its folder)"
fi

export RUSTICL_ENABLE=llvmpipe
rusticl=$(named_icd rusticl)
if [ "$rusticl" ] && has_device only_icd "$rusticl" "$GLINT"; then
    apart='plane disc box sphere triangle cylinder cone torus'
    [ "${GLINT_LONG_TESTS-}" != 1 ] || apart+=' all'
    for shape in $apart; do compare_apart rusticl "$shape" only_icd "$rusticl" "$GLINT"; done
else
    echo "skipped: rusticl with llvmpipe is not here"
fi
finish
