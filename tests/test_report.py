#!/usr/bin/env -S python3 -B
"""Tests glint report: what its archive holds, what it leaves out, and that it is written if a driver crashes, never returns or
rejects kernels.

run_tests: sanitize-long-only"""
import gzip
import io
import json
import os
import re
import signal
import socket
import subprocess
import tarfile
import time
import unittest

from glint import IS_SANITIZED, PROGRAM, TestCase, faults, main, need_device, write

need_device()
SMALL = "report S1 --precision single --lanes 1 -o r.tar.gz"
STEPS = ["devices", "passports", "verify", "bench"]
CRASHES, HANGS = faults("clBuildProgram crash"), faults("clBuildProgram hang")


class Report(TestCase):
    def setUp(self):
        super().setUp()
        for folder in "home", "temporary":
            os.mkdir(folder)
        self.env = {"HOME": os.path.abspath("home"), "TMPDIR": os.path.abspath("temporary"), "USER": "annuser",
                    "LOGNAME": "annuser", "CL_EXAMPLE": os.path.abspath("home/x"), "EXAMPLE": "not for others"}

    def report(self, command=SMALL, **env):
        """Returns standard error of the command, and the files of its archive. Checks that nothing else is left."""
        process = self.glint(command, env=self.env | env)
        files = {}
        with tarfile.open("r.tar.gz") as archive:
            for member in archive:
                self.assertEqual((member.uid, member.gid, member.uname, member.gname, member.mode), (0, 0, "", "", 0o644))
                files[member.name] = archive.extractfile(member).read().decode()
        self.assertEqual(process.stdout, f"r.tar.gz: {len(files)} files\n")
        self.assertEqual(os.listdir("temporary") + os.listdir("home"), [])
        listed = re.findall(r"(?m)^  (\S+\.\w+) +\S.*$", files["index.txt"])
        self.assertEqual(listed, list(files))
        here, host = os.getcwd(), socket.gethostname()
        for name, text in files.items():
            self.assertNotIn(here, text, name)
            self.assertNotIn("annuser", text, name)
            self.assertNotIn(f'"{host}"', text, name)
            self.assertTrue(name.endswith(".cl") or not re.search(r"(?m)(^|[\s\"=(])/\w", text), name)
        return process.stderr, files

    def failures(self, files):
        found = re.findall(r"(?m)^  (\w+) +(?:done|FAILED: (.*)), [0-9.]+ s$", files["index.txt"])
        self.assertEqual([step for step, _ in found], STEPS)
        return [(step, failure) for step, failure in found if failure]

    def test_archive(self):
        errors, files = self.report(f"{SMALL} {'S1 ' * 40} S5")
        self.assertEqual((errors, self.failures(files)), ("", []))
        devices, passports, verify, bench = (json.loads(files[f"{step}.json"]) for step in STEPS)
        self.assertEqual(devices["devices"][0]["name"], passports["devices"][0]["name"])
        self.assertTrue(passports["devices"][0]["passports"])
        precision, = verify["precisions"]
        self.assertEqual([(case["name"], case["passed"]) for case in precision["cases"]], [("S1", True), ("S5", True)])
        self.assertIn("S1", files["verify.txt"])
        run, = bench["runs"]
        self.assertEqual((run["scene"], run["lanes"], run["size"]), ("scene.yaml", 1, [160, 120]))
        self.assertEqual(bench["host"]["name"], "HOST")
        for kernel in precision["trace_kernel"], run["kernel_hash"]:
            self.assertTrue("kernel void" in files[f"kernels/{kernel}.cl"], kernel)
        kernels = [name for name in files if name.endswith(".cl")]
        self.assertTrue(any("passport" in files[name] for name in kernels))
        for name in kernels:
            self.assertRegex(files[name[:-2] + "log"], r"^device: .*\noptions: -cl-std.*\nbuild: CL_SUCCESS, [0-9.]+ s\n")
        self.assertRegex(files["versions.txt"], r"(?m)^zlib +1\.")
        self.assertIn("\nCL_EXAMPLE=~/x\n", files["versions.txt"])
        self.assertFalse([name for name, text in files.items() if "not for others" in text])

    def test_standard_output(self):
        """Nothing follows the archive on standard output."""
        command = [PROGRAM, *SMALL.replace("r.tar.gz", "-").split()]
        out = subprocess.run(command, env=os.environ | self.env, capture_output=True, check=True).stdout
        with tarfile.open(fileobj=io.BytesIO(gzip.decompress(out))) as archive:
            self.assertEqual(archive.getnames()[0], "index.txt")

    def test_tar_fails(self):
        os.mkdir("bin")
        write("bin/tar", "#!/bin/sh\necho unusual >&2\nexit 2\n")
        os.chmod("bin/tar", 0o755)
        path = f"{os.path.abspath('bin')}:{os.environ['PATH']}"
        errors = self.glint(SMALL, 2, env=self.env | {"PATH": path}).stderr
        folder = re.search(r"error: tar cannot write the archive: exit status 2: unusual; its files stay in (.*)\n", errors)[1]
        self.assertIn("index.txt", os.listdir(folder))
        self.assertFalse(os.path.exists("r.tar.gz"))

    def test_rejected_kernels(self):
        """The index names the steps that fail, and the logs say why. The root folder is not replaced by ~."""
        errors, files = self.report(f"{SMALL} --build-options=-Dget_global_id=unknown_word", HOME="//", CL_EXAMPLE="1 / 2")
        self.assertEqual([step for step, _ in self.failures(files)], ["verify", "bench"])
        self.assertEqual(errors.count("warning: the step "), 2)
        logs = "".join(text for name, text in files.items() if name.endswith(".log") and name.startswith("kernels/"))
        self.assertRegex(logs, "build: CL_BUILD_PROGRAM_FAILURE")
        self.assertIn("unknown_word", logs)
        self.assertIn("clBuildProgram", files["verify.log"])
        self.assertIn("\nCL_EXAMPLE=1 / 2\n", files["versions.txt"])

    @unittest.skipIf(IS_SANITIZED, "preloads a library before the sanitizer's")
    def test_crashes_and_hangs(self):
        _, files = self.report(**CRASHES)
        self.assertEqual([step for step, _ in self.failures(files)], STEPS[1:])
        self.assertIn("clBuildProgram", files["passports.log"])
        self.assertTrue(any(name.endswith(".cl") and name[:-2] + "log" not in files for name in files))
        _, files = self.report(f"{SMALL} --seconds 1", **HANGS)
        # on a busy machine the first step may take longer than a second
        failures = [(step, failure) for step, failure in self.failures(files) if step != STEPS[0]]
        self.assertEqual(failures, [(step, "stopped after 1 second") for step in STEPS[1:]])

    @unittest.skipIf(IS_SANITIZED, "preloads a library before the sanitizer's")
    def test_interrupt(self):
        command = [PROGRAM, *SMALL.split()]
        with subprocess.Popen(command, env=os.environ | self.env | HANGS, stderr=subprocess.PIPE, text=True) as process:
            while not any(name.endswith("passports.log") for _, _, names in os.walk("temporary") for name in names):
                time.sleep(0.01)
            process.send_signal(signal.SIGINT)
            errors = process.communicate()[1]
        self.assertEqual((process.returncode, errors), (130, "glint: interrupted\n"))
        self.assertEqual((os.listdir("temporary"), os.path.exists("r.tar.gz")), ([], False))

    def test_refused(self):
        self.refuses(f"{SMALL} S99", 'no case "S99".* S1, S2, ')
        self.refuses(f"{SMALL} --seconds 0", "--seconds: expected a number above 0")
        self.refuses(f"{SMALL} --lanes 3", "--lanes: expected 1")
        self.refuses(f"{SMALL} --precision certified", "--precision: expected single, strict or double, not .certified")
        self.refuses("report -o none/r.tar.gz", "none")
        self.refuses("verify S1 --keep-kernels none/kernels", "--keep-kernels: cannot create the folder 'none/kernels'")
        self.assertEqual(sorted(os.listdir()), ["home", "temporary"])


main()
