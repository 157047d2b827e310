#!/usr/bin/env -S python3 -B
"""glint-mpi: the image of several ranks has the bytes of one process's; errors of any rank end the job with a message; a killed
rank ends it, and its checkpoint goes on.

run_tests: sanitize-long-only"""
import json
import os
import random
import shlex
import shutil
import subprocess
import unittest
from pathlib import Path

from glint import IS_SANITIZED, PROGRAM, ROOT, SPHERE, TestCase, find_icd, has_device, main, skip_all, write

POCL = {"OCL_ICD_VENDORS": find_icd("pocl")}
MPI = POCL | {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
BUILD = os.environ.get("BUILD", "build")
RANKS = PROGRAM.parent / "glint-mpi"
RENDER = "render sphere.yaml --size 64x96 --samples 20 --quiet"


def environment():
    return {name: value for name, value in os.environ.items() if name != "GLINT_DEVICE"} | MPI | {"LC_ALL": "C"}


class Mpi(TestCase):
    def setUp(self):
        super().setUp()
        write("sphere.yaml", SPHERE)

    def mpirun(self, arguments, status=0):
        process = subprocess.run(["mpirun", *shlex.split(arguments)], env=environment(), stdin=subprocess.DEVNULL,
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
        self.assertEqual(process.returncode, status, f"mpirun {arguments}: {process.stderr}")
        return process

    def test_same_bytes(self):
        for precision in "single", "strict":
            command = f"{RENDER} --precision {precision} --aov position,object"
            self.glint(f"{command} -o one.npy", env=POCL)
            for count in 1, 2, 4:
                report = json.loads(self.mpirun(f"-n {count} {RANKS} {command} -o ranks.npy --timing=json").stdout)
                for end in "npy", "position.npy", "object.npy":
                    self.assertSameBytes(f"one.{end}", f"ranks.{end}")
                self.assertEqual(len(report["by_rank"]), count - 1)
                self.assertAlmostEqual(sum(part["share"] for part in report["by_device"] + report["by_rank"]), 1)

    def test_mixed_lanes(self):
        """Each rank gets the BVH of its own lanes."""
        scene = ROOT / "scenes/spheres16.yaml"
        for lanes in 1, 4:
            command = f"render {scene} --size 64x48 --bvh on --lanes {lanes} --precision strict --quiet"
            self.glint(f"{command} -o one.npy", env=POCL)
            self.mpirun(f"-n 2 {RANKS} {command} -o ranks.npy")
            self.assertSameBytes("one.npy", "ranks.npy")

    def test_errors(self):
        self.assertRegex(self.mpirun(f"-n 2 {RANKS} bench sphere.yaml", 1).stderr, "usage: mpirun")
        self.assertRegex(self.mpirun(f"-n 2 {RANKS} {RENDER} --sizes 3", 1).stderr, "unrecognized option")
        self.assertRegex(self.mpirun(f"-n 2 {RANKS} render none.yaml", 1).stderr, "none.yaml")
        self.assertRegex(self.mpirun(f"-n 2 {RANKS} {RENDER} -o /nowhere/image.png", 1).stderr, "cannot create '/nowhere/image.png'")
        process = self.mpirun(f"-n 1 {RANKS} {RENDER} : -n 1 -x OCL_ICD_VENDORS=/none {RANKS} {RENDER}", 1)
        self.assertRegex(process.stderr, "rank 1 on .*: no OpenCL device")

    def test_a_killed_rank(self):
        command = f"{RENDER.replace('20', '20000')} --precision strict"
        self.glint(f"{command} -o one.npy", env=POCL)
        moments = random.Random(1)
        for kill in range(3):
            process = subprocess.Popen(["mpirun", "-n", "3", RANKS, *command.split(), "-o", "ranks.npy", "--checkpoint", "saved"],
                                       env=environment(), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
            try:
                process.wait(moments.uniform(0.5, 1.5))
            except subprocess.TimeoutExpired:
                ranks = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="utf-8").split()
                if ranks:
                    os.kill(int(ranks[kill % len(ranks)]), 9)
            process.wait(120)
        self.mpirun(f"-n 3 {RANKS} {command} -o ranks.npy --checkpoint saved")
        self.assertSameBytes("one.npy", "ranks.npy")
        self.assertFalse(os.path.exists("saved"))


if __name__ == "__main__":
    if not shutil.which("mpirun") or subprocess.run(["pkg-config", "--exists", "ompi-c"], check=False).returncode:
        skip_all("Open MPI is not installed")
    if IS_SANITIZED:
        skip_all("Open MPI leaks")
    if not has_device(env=POCL):
        skip_all("PoCL is not installed")
    made = subprocess.run(["make", "-s", "mpi", f"BUILD={os.path.relpath(BUILD, ROOT)}"], cwd=ROOT, check=False)
    if made.returncode:
        raise SystemExit("make mpi failed")
    main()
