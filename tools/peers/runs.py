"""Runs programs, compares the images that they leave, and describes the machine."""
import collections
import concurrent.futures
import operator
import os
import pathlib
import platform
import re
import subprocess
import tempfile
import time


def apart(function, *arguments):
    """Calls a function in a separate process, because Linux counts this process's memory toward the peak of its child processes."""
    with concurrent.futures.ProcessPoolExecutor(1) as child:
        return child.submit(function, *arguments).result()


Run = collections.namedtuple("Run", "seconds processor_seconds peak stdout stderr")


def run_once(command, environment=None):
    """Runs a command. Returns its wall seconds, its seconds of all processors, its peak bytes and its output."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        start = time.monotonic()
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=errors, env=environment)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.monotonic() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for stream in out, errors:
            stream.seek(0)
            texts.append(stream.read())
    if process.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: exit status {process.returncode}: {texts[1][-2000:]}")
    return Run(seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, *texts)


def read_ppm(path):
    """Returns the channels of an 8-bit PPM."""
    content, at, words = path.read_bytes(), 0, []
    while len(words) < 4:
        end = content.index(b"\n", at)
        words += content[at:end].split(b"#")[0].split()
        at = end + 1
    assert words[0] == b"P6" and words[3] == b"255" and len(content) - at == 3 * int(words[1]) * int(words[2]), path
    return content[at:]


def image_difference(path, other_path):
    """Returns the mean and largest absolute difference in 255ths, and the fraction of pixels of which some channel differs by
    more than 2."""
    off = bytes(map(abs, map(operator.sub, read_ppm(path), read_ppm(other_path))))
    worst = bytes(map(max, off[0::3], off[1::3], off[2::3]))
    channels, pixels = collections.Counter(off), collections.Counter(worst)
    return {"mean": sum(value * count for value, count in channels.items()) / len(off), "max": max(channels),
            "pixels_off": sum(count for value, count in pixels.items() if value > 2) / len(worst)}


def output_lines(*command):
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.splitlines()
    except OSError:
        return []


def machine():
    info = dict(re.findall(r"^([^\t:]+?)\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text().split("\n\n")[0], re.M))
    memory = re.search(r"MemTotal:\s+(\d+) kB", pathlib.Path("/proc/meminfo").read_text())
    return {"processor": info.get("model name"), "family": info.get("cpu family"), "model": info.get("model"),
            "mhz": info.get("cpu MHz"), "avx512": "avx512f" in info.get("flags", ""), "cores": os.cpu_count(),
            "memory_gib": round(int(memory.group(1)) / 2**20, 1), "system": platform.platform(),
            "compiler": (output_lines(os.environ.get("CC", "cc"), "--version") or [None])[0],
            "packages": output_lines("dpkg-query", "-W", "pocl-opencl-icd", "libembree3-3", "tachyon", "povray")}
