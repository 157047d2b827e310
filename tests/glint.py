"""Runs the program in a separate folder for the Python tests, and reads the files that it writes.

Tests are the executable tests/test_*.py; other Python files are helpers. A test finds the program in GLINT and its build
folder in BUILD, and exits with 77 when it skips. Kernel caches are those of XDG_CACHE_HOME, shared by the tests of a run.
"""
import ast
import contextlib
import csv
import functools
import importlib.util
import json
import math
import os
import pty
import re
import shlex
import signal
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(os.environ.get("GLINT", ROOT / "build/glint")).resolve()
BUILD = Path(os.environ.get("BUILD", PROGRAM.parent))
FAULTS_LIBRARY = BUILD.resolve() / "tests/faults.so"  # before a test changes the folder
IS_SANITIZED = BUILD.name.endswith("-sanitize")
IS_LONG = os.environ.get("GLINT_LONG_TESTS") == "1"
# SPHERE, PLANET and BALLS have the same features, so that the same kernels serve the tests of each.
SPHERE = """\
camera: {position: [0, 0, -4], look_at: [0, 0, 0], fov: 60}
background: [0.1, 0.2, 0.4]
lights:
  - point: {position: [3, 4, -5]}
  - point: {position: [0, 9, -3], color: [0.2, 0.2, 0.2]}
objects:
  - sphere: {material: {reflection: 0.1}, center: [0, 0, 0], radius: 1}
"""
# With errors a thousand times a device's, shadow rays start above the small sphere on the large one, so that it has no shadow.
PLANET = """\
camera: {position: [0, 150, 0], look_at: [0, 100, 0], up: [0, 0, 1], fov: 0.02}
lights: [{point: {position: [2, 101, -1]}}]
objects:
  - sphere: {center: [0, 0, 0], radius: 100, material: {reflection: 0.1}}
  - sphere: {center: [0, 100.001, 0], radius: 0.001}
"""
BALLS = f"{ROOT}/tests/scenes/mirror-balls.yaml"


def plain(name, folder="."):
    """Returns one of scenes/, or unless tests are long a copy with the features of BALLS, so that the same kernels serve both."""
    if IS_LONG:
        return ROOT / "scenes" / name
    others = "plane:", "box:", "cylinder:", "directional:"
    kept = [line for line in read(ROOT / "scenes" / name).splitlines() if not any(word in line for word in others)]
    text = "\n".join(kept)
    changed = text.replace("specular: 0.4", "specular: 0.4, reflection: 0.25", 1)
    assert changed != text, name
    return write(f"{folder}/{name}", changed)


def skip_all(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def run(command, wrapper=(), env=None, **options):
    """Runs `glint COMMAND` and returns the finished process. A wrapper is the command that starts the program."""
    options = {"stdin": subprocess.DEVNULL} | options if "input" not in options else options
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    environment = {name: value for name, value in os.environ.items() if name != "GLINT_DEVICE"} | {"LC_ALL": "C"}
    return subprocess.run([*wrapper, PROGRAM, *shlex.split(command)], env=environment | (env or {}), **options)


def terminal_run(command):
    """Returns what `glint COMMAND`, whose report goes to a file, prints on the terminal."""
    terminal, end = pty.openpty()
    with open("report.json", "w", encoding="utf-8") as report:
        process = run(command, stdout=report, stderr=end)
    os.close(end)
    shown = b""
    with contextlib.suppress(OSError):  # all is read, and nobody writes
        while part := os.read(terminal, 4096):
            shown += part
    os.close(terminal)
    assert process.returncode == 0, shown
    json.loads(read("report.json"))
    return shown.decode()


def shim_build(name, source, *flags):
    """Builds a library that a test preloads from C; returns its path."""
    compiler = shlex.split(os.environ.get("CC", "cc"))
    # before C23, a function declared with () takes any arguments
    command = [*compiler, "-std=gnu11", "-w", "-shared", "-fPIC", "-x", "c", "-", "-o", name, *flags]
    subprocess.run(command, input=source, text=True, check=True)
    return os.path.abspath(name)


def preloaded(*libraries, **variables):
    """Returns an environment that preloads libraries. They may come before a sanitizer, since they call nothing before main."""
    options = f"{os.environ.get('ASAN_OPTIONS', '')}:verify_asan_link_order=0"
    return {"LD_PRELOAD": " ".join(map(str, libraries)), "ASAN_OPTIONS": options, **variables}


def faults(rules):
    """Returns an environment in which calls fail by rules (tests/failing/faults.h)."""
    return preloaded(FAULTS_LIBRARY, GLINT_FAULTS=rules)


def need_device():
    """Skips the whole test if there is no OpenCL device. Returns the default device."""
    process = run("devices --json")
    if process.returncode != 0:
        skip_all(f"no OpenCL device: {process.stderr}")
    return next(device for device in json.loads(process.stdout)["devices"] if device["default"])


@functools.cache
def probed_device():
    """Returns the default device with its passports, measured without any test's shim."""
    return next(device for device in json.loads(run("devices --probe --json").stdout)["devices"] if device["default"])


def refused_precisions():
    return {refusal["precision"] for refusal in probed_device()["refused"]}


def broken_at_single():
    """Returns the properties that the bounds of `single` assume and the default device lacks, as text."""
    return ", ".join(f"{found['name']}: {found['value']}" for passport in probed_device()["passports"]
                     for found in passport["properties"]
                     if passport["precision"] == "single" and found["finding"] == "broken")


def need_clang(tool):
    """Builds what one of tools/kernels/ needs to compile kernels by clang. Returns the version of clang. Skips the whole test if
    clang is missing, and for a sanitized build, which has the same kernels as the plain one."""
    if IS_SANITIZED:
        skip_all("the plain build's kernels are the same")
    process = subprocess.run([ROOT / "tools/kernels" / tool, "--clang"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if process.returncode == 77:
        skip_all(process.stdout)
    subprocess.run([os.environ.get("MAKE", "make"), "-s", f"BUILD={BUILD}", "kernel_text"], cwd=ROOT, check=True)
    return int(process.stdout)


def find_python(*modules):
    """Returns a Python that has the modules, MODULE=REQUIREMENT of pip, or, after printing the reason, None."""
    script = '. tests/support.bash; python_with "$@" && echo "$python"'
    process = subprocess.run(["bash", "-c", script, "bash", *modules], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    if process.returncode == 0:
        return process.stdout.strip()
    print(process.stdout, end="")
    return None


def need_modules(*modules):
    """Restarts the test in a Python that has the modules, MODULE=REQUIREMENT of pip. Skips it if there is none."""
    if all(importlib.util.find_spec(module.partition("=")[0]) for module in modules):
        return
    python = find_python(*modules)
    if not python:
        sys.exit(77)
    os.execvp(python, [python, "-B", *sys.argv])


def find_icd(name):
    """Returns the file by which the OpenCL loader finds an implementation, as OCL_ICD_VENDORS takes it."""
    return next(map(str, Path("/etc/OpenCL/vendors").glob(f"*{name}*.icd")), "/not-installed.icd")


def has_device(**options):
    return re.search("^ *[0-9]", run("devices", **options).stdout, re.MULTILINE) is not None


# Environments with PoCL alone, and with its device twice.
POCL = {"OCL_ICD_VENDORS": find_icd("pocl")}
TWO = POCL | {"POCL_DEVICES": "pthread pthread"}


def need_pocl():
    if not has_device(env=POCL):
        skip_all("PoCL is not installed")


class TestCase(unittest.TestCase):
    """Each test runs in a new folder with these files."""

    files = {}
    maxDiff = 4000

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, ROOT)
        os.chdir(folder.name)
        for name, text in self.files.items():
            write(name, text)

    def skip_if_refused(self, reason):
        """Skips the test if the reason is that the default device's arithmetic does not have a precision."""
        refusal = re.search(r"lacks arithmetic that precision (\w+) relies on.*", reason)
        if refusal and refusal[1] in refused_precisions():
            self.skipTest(refusal[0])

    def glint(self, command, status=0, **options):
        """Runs `glint COMMAND`, which must exit with the status."""
        process = run(command, **options)
        if process.returncode != status:
            self.skip_if_refused(process.stderr)
            if process.returncode == 3 and "--precision single" in command and broken_at_single():
                self.skipTest(f"glint {command} fails: {broken_at_single()}")
        self.assertEqual(process.returncode, status, f"glint {command}: {process.stderr}")
        return process

    def refuses(self, command, pattern, status=1, **options):
        """Checks that `glint COMMAND` exits with the status, reports why on standard error and prints nothing."""
        process = self.glint(command, status, **options)
        if not re.search(pattern, process.stderr, re.MULTILINE):
            self.skip_if_refused(process.stderr)
        self.assertRegex(process.stderr, re.compile(pattern, re.MULTILINE), f"glint {command}")
        self.assertEqual(process.stdout, "", f"glint {command}")
        return process

    def json(self, command, status=0, **options):
        return json.loads(self.glint(command, status, **options).stdout)

    def assertSameBytes(self, path, other):
        if Path(path).read_bytes() != Path(other).read_bytes():
            self.fail(f"{path} and {other} differ")

    def nothing_left(self, pattern):
        """Checks that no file of the folder fits the pattern, nor one with a dot before it."""
        self.assertEqual([*Path().glob(pattern), *Path().glob(f".{pattern}")], [])


def write(path, text):
    Path(path).write_text(text, encoding="utf-8")
    return path


def read(path):
    return Path(path).read_text(encoding="utf-8")


def npy_read(path):
    """Returns shape, type and pixels of an image of float, double or unsigned. Pixels are numbers, or tuples if it has channels.
    Fails at NaN, since comparisons with it may pass."""
    data = Path(path).read_bytes()
    assert data[:8] == b"\x93NUMPY\x01\x00", path
    (length,) = struct.unpack("<H", data[8:10])
    head = ast.literal_eval(data[10 : 10 + length].decode())
    assert not head["fortran_order"]
    letter = {"<f4": "f", "<f8": "d", "<u4": "I"}[head["descr"]]
    channels = math.prod(head["shape"][2:])
    pixels = list(struct.iter_unpack(f"<{channels}{letter}", data[10 + length :]))
    assert not any(math.isnan(value) for pixel in pixels for value in pixel), path
    return head["shape"], head["descr"], pixels if head["shape"][2:] else [value for (value,) in pixels]


def png_bytes(rows, color=2, *extra):
    """Returns an 8-bit image of rows of bytes, by default RGB, with extra chunks."""
    width = len(rows[0]) // {0: 1, 2: 3, 3: 1, 6: 4}[color]
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, len(rows), 8, color, 0, 0, 0)), *extra,
        (b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows))), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks)


def png_read(path):
    """Returns (width, height, bits, color type), raw rows, texts by keyword, and the types of chunks. Checks every checksum."""
    data = Path(path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    at, chunks = 8, []
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size : at + 12 + size])[0] == zlib.crc32(kind + body)
        chunks.append((kind.decode(), body))
        at += 12 + size
    assert chunks[-1][0] == "IEND"
    rows = zlib.decompress(b"".join(body for kind, body in chunks if kind == "IDAT"))
    texts = dict(body.decode("latin-1").split("\0", 1) for kind, body in chunks if kind == "tEXt")
    return struct.unpack(">IIBB", chunks[0][1][:10]), rows, texts, [kind for kind, _ in chunks]


def file_size(path):
    """Returns the size of a file that other processes write, or 0 if there is none."""
    try:
        return os.stat(path).st_size
    except FileNotFoundError:  # it may have just been removed
        return 0


def checkpoint_rows(path):
    """Returns the number of rows of all whole records, which have only colors, or 0 if there is no such file."""
    data = Path(path).read_bytes() if Path(path).exists() else b""
    record, rows = struct.Struct("<6IQQQ16s"), 0
    at = data.find(b"\0", struct.calcsize("<16sQ16s")) + 1 or len(data)
    while at + record.size <= len(data):
        width, _, row_count, _, real_size, *_ = record.unpack_from(data, at)
        at += record.size + 3 * width * row_count * real_size
        rows += row_count if at <= len(data) else 0
    return rows


def csv_rows(text):
    """Returns lists of the numbers below the head, with None for an empty cell."""
    head, *rows = csv.reader(text.splitlines())
    return head, [[float(cell) if cell else None for cell in row] for row in rows]


def main():
    """Runs the tests of the file that is executed. A skip is reported as cmocka does, which tools/run_tests shows."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup ignores it
    result = unittest.main(exit=False).result
    for test, reason in result.skipped:
        print(f"[  SKIPPED ] {test}\n{test}: {reason}")
    whole = [test for test, _ in result.skipped if not hasattr(test, "test_case")]  # no subtests
    if len(whole) < result.testsRun and result.skipped:
        print("[       OK ] the others")
    if not result.wasSuccessful() or result.testsRun == 0:
        sys.exit(1)
    sys.exit(77 if len(whole) == result.testsRun else 0)
