"""Compiles the kernels with clang for one ray per work-item, for tools/kernels/gpu-resources and tools/kernels/spirv-form."""
import functools
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("BUILD", ROOT / "build"))
OLDEST_CLANG, NEWEST_CLANG = 15, 40
FIRST_FILE = '#line 1 "render.cl"'  # follows the scene's definitions
# Drivers define __OPENCL_VERSION__ themselves.
OPTIONS = ["-x", "cl", "-cl-std=CL1.2", "-D__OPENCL_VERSION__=120", "-Xclang", "-finclude-default-header", "-w",
           "-I", ROOT / "kernels", "-I", BUILD]  # for all_shapes.h


def fail(message, status=1):
    print(f"{Path(sys.argv[0]).name}: {message}", file=sys.stderr)
    sys.exit(status)


def run(*command):
    """Returns what a command printed to stdout and stderr."""
    process = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if process.returncode != 0:
        fail(f"{' '.join(map(str, command))} failed:\n{process.stdout}")
    return process.stdout


def clang_version(needs, is_usable):
    """Returns the newest usable version of clang. If there is none, exits with 77 and a message that names the requirements."""
    for version in range(NEWEST_CLANG, OLDEST_CLANG - 1, -1):
        if shutil.which(f"clang-{version}") and is_usable(version):
            return version
    return fail(f"needs clang-N, N being {OLDEST_CLANG} or more, and {needs}", 77)


def clang(version, source, output, *options):
    return run(f"clang-{version}", *OPTIONS, *options, "-o", output, source)


@functools.lru_cache(maxsize=None)
def scene_definitions(path, precision):
    text = run(BUILD / "tools/kernels/kernel_text", path, precision)
    return text[:text.index(FIRST_FILE)]


def kernel_write(name, kernel, folder):
    """Writes the program that compiles a file of kernels/, such as "render", for SCENE[:PRECISION]; returns its path."""
    scene, _, precision = name.partition(":")
    path = scene if "/" in scene else ROOT / f"scenes/{scene}.yaml"
    source = Path(folder) / f"program-{kernel}.cl"
    source.write_text(f'{scene_definitions(path, precision or "single")}\n#include "{kernel}.cl"\n')
    return source
