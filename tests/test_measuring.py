#!/usr/bin/env -S python3 -B
"""Tests how the programs of tools/measure run glint, with a script in its place."""
import json
import os
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path
from unittest import mock

from glint import ROOT, TestCase, main, read, write

sys.path.insert(0, str(ROOT / "tools/measure"))
import measuring


# What verify-everywhere asks for before it runs cases.
DEVICES = {"devices": [{"default": True, "name": "x", "fp64": True, "platform_version": "", "correctly_rounded_divide_sqrt": True}]}


def has_ended(pid):
    """Waits for a killed process, which the kernel ends some time after the signal."""
    status = Path(f"/proc/{pid.strip()}/stat")
    for _ in range(300):
        try:
            if ") Z " in read(status):
                return True
        except (FileNotFoundError, ProcessLookupError):
            return True
        time.sleep(0.1)
    return False


class Measuring(TestCase):
    def fake(self, text):
        """Puts a shell script in glint's place."""
        path = write("fake", f"#!/bin/sh\n{text}\n")
        os.chmod(path, 0o755)
        patch = mock.patch.object(measuring, "GLINT", os.path.abspath(path))
        patch.start()
        self.addCleanup(patch.stop)

    def fails(self, message, **limits):
        with self.assertRaisesRegex(measuring.Failure, message) as raised:
            measuring.glint_json("verify", **limits)
        return raised.exception

    def test_results(self):
        for status in 0, measuring.EXIT_CHECK:
            self.fake(f"echo '[\"'$1 $2'\"]'; exit {status}")
            self.assertEqual(measuring.glint_json("verify"), ["verify --json"])

    def test_failures(self):
        for text, message in (("echo first >&2; echo last >&2; exit 2", "exit status 2: last$"),
                              ("exit 1", "exit status 1: no message"), ("echo '{'", "not JSON: '{")):
            with self.subTest(text):
                self.fake(text)
                self.assertFalse(self.fails(message).timed_out)

    def test_child_processes_end(self):
        """A timeout and Ctrl-C end the script's process group."""
        self.fake("sleep 600 & echo $! >child; wait")
        self.assertTrue(self.fails("timed out after 1 s", seconds=1).timed_out)
        self.assertTrue(has_ended(read("child")))
        previous = signal.signal(signal.SIGALRM, signal.default_int_handler)
        self.addCleanup(signal.signal, signal.SIGALRM, previous)
        signal.setitimer(signal.ITIMER_REAL, 1)
        with self.assertRaises(KeyboardInterrupt):
            measuring.glint("verify")
        self.assertTrue(has_ended(read("child")))

    def test_rows_of_verify_everywhere(self):
        """An answer with other cases, or one that is not JSON, is a row with the reason. The report has what was measured."""
        write("pocl.icd", "")
        environment = {**os.environ, "OCL_ICD_VENDORS": "."}
        for answer, why in ('{"precisions": [{"cases": [{"name": "S3"}]}]}', "other cases answered"), ("oops", "not JSON"):
            self.fake(f"[ $1 = verify ] && echo '{answer}' || echo '{json.dumps(DEVICES)}'")
            command = [ROOT / "tools/measure/verify-everywhere",
                       *"--cases S1 --precisions strict --only pocl -o report.json".split()]
            process = subprocess.run(command, env={**environment, "GLINT": measuring.GLINT}, capture_output=True, text=True)
            self.assertEqual(process.returncode, measuring.EXIT_CHECK, process.stderr)
            row, = json.loads(read("report.json"))["implementations"][0]["precisions"]
            self.assertRegex(row["why"], why)


if __name__ == "__main__":
    main()
