#!/bin/bash
# Checks that a render's memory is that of a band, not of the image. GLINT_LONG_TESTS=1 also renders the whole 32768x32768
# (minutes).
. "$(dirname "$0")/support.bash"
is_sanitized && skip_all 'a sanitized program needs more memory'
cd "$scratch" || exit 1
cat >ball.yaml <<'E2'
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
lights: [{directional: {direction: [1, -1, 2]}}]
objects:
  - sphere: {center: [0, 0, 0], radius: 1}
  - plane: {point: [0, -1, 0], normal: [0, 1, 0]}
E2

# peak WIDTHxHEIGHT OPTIONS…: prints the largest memory of a render, or of its largest rank, in MiB, with its seconds.
program=("$GLINT")
scene=ball.yaml
peak() {
    python3 - "${program[@]}" render "$scene" --quiet --size "$@" <<'E2'
import resource, subprocess, sys, time
start = time.monotonic()
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024, '%.1f' % (time.monotonic() - start))
E2
}
# bounded MIB WIDTHxHEIGHT OPTIONS…
bounded() {
    local bound=$1 measured
    shift
    if ! measured=$(peak "$@" 2>err); then
        fail "$*: $(cat err)"
    elif [ "${measured% *}" -lt "$bound" ]; then
        pass
        echo "$*: ${measured% *} MiB at most, ${measured#* } s"
    else
        fail "$*: ${measured% *} MiB, not below $bound MiB"
    fi
}

# builds the kernels of these options, since the memory of the driver's compiler, half a GiB in PoCL 7.1, does not count
built() { check "64x64 $*" "$GLINT" render "$scene" --quiet --size 64x64 "$@"; }

# 10,000 instances of a mesh of 20,000 triangles, which share it
python3 - <<'E2'
SIDE, INSTANCES = 100, 10000
with open("mesh.obj", "w") as mesh:
    for i in range((SIDE + 1) ** 2):
        x, z = i % (SIDE + 1), i // (SIDE + 1)
        mesh.write(f"v {x / SIDE} {x * z % 7 / 70} {z / SIDE}\n")
    for i in range(SIDE ** 2):
        a = i // SIDE * (SIDE + 1) + i % SIDE + 1
        mesh.write(f"f {a} {a + 1} {a + SIDE + 2}\nf {a} {a + SIDE + 2} {a + SIDE + 1}\n")
with open("many.yaml", "w") as scene:
    scene.write("camera: {position: [0, 80, -90], look_at: [0, 0, 0], fov: 60}\n"
                "lights: [{directional: {direction: [1, -1, 2]}}]\n"
                "define: {tile: {objects: [{mesh: {file: mesh.obj}}]}}\nobjects:\n")
    for i in range(INSTANCES):
        place = f"[{i % 100 - 50}, {i % 3}, {i // 100 - 50}]"
        scene.write(f"  - instance: {{of: tile, transform: {{rotate: [{i % 50}, {i}, 0], translate: {place}}}}}\n")
E2
scene=many.yaml
built -o many.png
bounded 200 1280x720 -o many.png
scene=ball.yaml

built -o small.png
bounded 200 64x64 -o small.png
bounded 200 8192x2048 -o wide.png
bounded 200 256x65536 -o tall.ppm
built --samples 4 --aov t,normal -o deep.exr
# PoCL 6.0 takes 55 MiB more than PoCL 3.1; the whole image would take 235 MiB
bounded 240 4096x2048 --samples 4 --aov t,normal -o deep.exr
! is_long || bounded 1024 32768x32768 -o huge.png
# PoCL as two devices: bands that wait for one above them are also bounded, or in the checkpoint
export POCL_DEVICES='pthread pthread'
bounded 300 8192x2048 --device portable,1 -o wide.png
bounded 300 8192x2048 --device portable,1 --checkpoint saved -o wide.png
! is_long || bounded 1024 32768x32768 --device portable,1 --checkpoint saved -o huge.png
if is_long && command -v mpirun >/dev/null && [ -x "${GLINT%/*}/glint-mpi" ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
    export PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
    program=(mpirun -n 4 "${GLINT%/*}/glint-mpi")
    bounded 1024 32768x32768 -o huge.png
fi
finish
