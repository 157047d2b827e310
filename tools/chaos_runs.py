"""Runs glint commands with injected failures, for tools/chaos, and checks the guarantees that hold after each."""
import os
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from chaos_files import GLTF, MESH_SCENE, OBJ, OFF, OFF_SCENE, PLY, SCENE, pixels
from png import RGB, png

OLD = b"an earlier output"
HANG_SECONDS, WINDOW_SECONDS = 60, 5
STATUSES = {0, 1, 2, 3, 4, 130}


class Command:
    """A command line of glint, the files that it writes, and its results without failures."""

    def __init__(self, line, *outputs, fault_types=("opencl", "creating", "allocation", "file"), is_slow=False, within=""):
        self.line, self.outputs, self.fault_types, self.is_slow = line, outputs, fault_types, is_slow
        self.within = within  # "child " makes calls fail in child processes only
        self.is_resumable = "--checkpoint" in line  # resumes after a failure
        self.status, self.written, self.counts = None, {}, {}


class Test:
    def __init__(self, name):
        self.name, self.tries, self.possible, self.violations, self.seconds = name, 0, 0, [], 0


def process_seconds(process):
    """Returns the processor seconds of a running process and its reaped children."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


class Runner:
    """Runs commands in a folder and records each broken guarantee."""

    def __init__(self, options, folder, shim, commands):
        self.options, self.folder, self.shim = options, folder, shim
        self.work = folder / "work"
        self.work.mkdir()
        self.log = folder / "log"
        self.commands = [command for command in commands if (options.long or not command.is_slow) and options.only in command.line]
        self.tests = []
        self.test = None
        # the driver's cache lies outside the folder where calls fail
        self.environment = {**os.environ, "LC_ALL": "C", "XDG_CACHE_HOME": str(self.work / "cache"),
                            "POCL_CACHE_DIR": str(folder / "pocl"), "TMPDIR": str(self.work),
                            "SDL_VIDEODRIVER": "dummy"}
        (folder / "pocl").mkdir()
        files = {"plain.yaml": SCENE, "mesh.yaml": MESH_SCENE, "mesh.obj": OBJ, "mesh.ply": PLY,
                 "off.yaml": OFF_SCENE, "mesh.off": OFF, "mesh.gltf": GLTF,
                 "rays": "0 0 -4 0 0 1\n0 5 0 0 -1 0\n9 9 9 1 0 0\n", "texture.png": png(2, 2, RGB, b"\0\1\2\3\4\5\6" * 2),
                 "before.png": png(2, 1, RGB, b"\0\1\2\3\4\5\6"), "after.png": png(2, 1, RGB, b"\0\1\2\3\4\5\7")}
        for name, content in files.items():
            (self.work / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        self.inputs = set(files) | {"cache"}

    def start(self, line, fault=None, limit=None, denied=None):
        settings = dict(self.environment)
        if fault or denied:
            settings |= {"LD_PRELOAD": str(self.shim), "GLINT_FAULT_LOG": str(self.log), "GLINT_CHAOS_FOLDER": str(self.work)}
            settings |= {"GLINT_FAULTS": fault} if fault else {"GLINT_DENIED": str(denied)}
        program = self.options.glint + ("-view" if line.startswith("view") else "")
        return subprocess.Popen([program, *shlex.split(line)], cwd=self.work, env=settings, text=True,
                                errors="replace", stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, start_new_session=True,
                                preexec_fn=limit and (lambda: resource.setrlimit(limit[0], (limit[1], limit[1]))))

    def finish(self, process):
        """Returns the exit status, None if the process did not end, and its messages: stderr, else the report of a check or --json."""
        if "view" in process.args:  # interrupted after the failure, or after WINDOW_SECONDS
            end = time.monotonic() + WINDOW_SECONDS
            while process.poll() is None and not self.failed_call() and time.monotonic() < end:
                time.sleep(0.05)
            time.sleep(0.3)
            process.terminate()
        used = 0
        while True:
            try:
                report, errors = process.communicate(timeout=HANG_SECONDS)
                break
            except subprocess.TimeoutExpired:  # a busy machine may have left it little processor time
                before, used = used, process_seconds(process.pid)
                if used > HANG_SECONDS or used < before + 1:
                    os.killpg(process.pid, signal.SIGKILL)
                    return None, process.communicate()[1]
        return process.returncode, errors or (report if process.returncode == 3 or "--json" in process.args else "")

    def violated(self, what, line, cause, errors):
        failed = self.failed_call()
        self.test.violations.append(f"{what}: glint {line}" + (f" ({cause}{failed})" if cause else "") +
                                    f": {errors.strip()[:300]!r}")

    def failed_call(self):
        text = self.log.read_text() if self.log.exists() else ""
        return f", {text.splitlines()[0]}" if text.startswith("failed") else ""

    def remains(self):
        return sorted(path.name for path in self.work.iterdir() if path.name not in self.inputs)

    def clear(self):
        for name in self.remains():
            path = self.work / name
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()

    def check_end(self, command, status, errors, cause=None):
        """Checks that a run ended as every run must, whatever failed."""
        line = command.line
        if status is None:
            self.violated("did not end", line, cause, errors)
        elif status < 0:
            self.violated(f"ended by signal {-status}", line, cause, errors)
        elif status not in STATUSES:
            self.violated(f"exit status {status}", line, cause, errors)
        elif status != command.status and not errors.strip():
            self.violated(f"exit status {status} without a message", line, cause, errors)

    def check_outputs(self, command, status, errors, cause=None):
        for name in command.outputs:
            path = self.work / name
            content = pixels(path.read_bytes()) if path.exists() else None
            whole = command.written[name]
            if status == command.status and content != whole:
                self.violated(f"{name} is not what it should be, with exit status {status}", command.line, cause, errors)
            elif content not in (whole, OLD):
                self.violated(f"{name} is broken or lost", command.line, cause, errors)

    def check_files(self, command, status, errors, cause=None):
        """Checks the files that a run left, whatever failed, and removes them."""
        line = command.line
        self.check_outputs(command, status, errors, cause)
        left = [name for name in self.remains() if name not in command.outputs]
        if left:
            self.violated(f"left {left}", line, cause, errors)
        self.clear()

    def clear_caches(self):
        for cache in self.work / "cache", self.folder / "pocl":
            shutil.rmtree(cache, ignore_errors=True)
            cache.mkdir()

    def attempt(self, command, fault=None, limit=None, denied=None):
        self.log.unlink(missing_ok=True)
        for name in command.outputs:
            (self.work / name).write_bytes(OLD)
        status, errors = self.finish(self.start(command.line, fault, limit, denied))
        self.test.tries += 1
        cause = f"GLINT_FAULTS={fault!r}" if fault else f"setrlimit{limit}" if limit else f"GLINT_DENIED={denied}" if denied else None
        if fault and fault.endswith(" kill") and status == -signal.SIGKILL:  # the next run must succeed and remove what is left
            self.check_outputs(command, status, errors, cause)
            status, errors = self.resume(command, cause, may_warn=True)  # of a part of a band in a checkpoint
        self.check_end(command, status, errors, cause)
        if command.is_resumable and (status != command.status or errors):
            status, errors = self.resume(command, cause)
        self.check_files(command, status, errors, cause)
        return status, errors

    def resume(self, command, cause=None, may_warn=False):
        """Runs the command again without a failure and checks that it succeeds, and unless it may warn, in silence."""
        status, errors = self.finish(self.start(command.line))
        if status != command.status or (errors and not may_warn):
            self.violated(f"does not recover: exit status {status}", command.line, cause, errors)
        return status, errors

    def learn(self, command):
        """Records what the command does when nothing fails, and how many calls it makes."""
        counting = "; ".join(f"{fault_type} count" for fault_type in command.fault_types)
        for _ in range(3):  # timings may choose a size for which the driver has not compiled a kernel
            for fault in None, command.within + counting:  # the first run fills the caches
                self.log.unlink(missing_ok=True)
                command.status, errors = self.finish(self.start(command.line, fault))
            if command.status in (0, 3, 130):
                break
        if command.status not in (0, 3, 130) or not self.log.exists():
            sys.exit(f"chaos: glint {command.line} does not run here: {errors}")
        command.written = {name: pixels((self.work / name).read_bytes()) for name in command.outputs}
        if "failed seccomp" in self.log.read_text():
            print("chaos: system calls cannot be trapped here")
            sys.exit(77)
        pairs = (line.split() for line in self.log.read_text().splitlines())
        command.counts = {name: int(count) for name, count in pairs if name != "failed"}
        self.clear()
