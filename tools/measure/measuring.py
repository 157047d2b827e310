"""Serves the programs of this folder: runs glint ($GLINT if it is set, else build/glint) on each OpenCL implementation of this
machine, reads lists of seeds, and writes reports."""
import collections
import contextlib
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
GLINT = os.environ.get("GLINT", ROOT / "build/glint")
EXIT_CHECK = 3  # glint's exit status if a case fails or images differ
# Cases of a few dozen rays, for an interpreter.
FEW_CASES = "S1 S3 S5 P4 C1 C2 C5 C7 T6 M3"

# An OpenCL implementation: the command before glint, the environment, and the cases that it can run or None for all.
Implementation = collections.namedtuple("Implementation", "prefix environment few_cases", defaults=([], {}, None))


class Failure(SystemExit):
    """The reason why glint printed no result. Ends the program if it is not caught."""
    timed_out = False


class TimedOut(Failure):
    timed_out = True


def implementations(scratch):
    """Returns the implementations of this machine by name, PoCL first: each client driver of /etc/OpenCL/vendors
    (OCL_ICD_VENDORS names another folder), Intel's CPU runtime below INTEL_OPENCL_RT, and Oclgrind. rusticl runs on llvmpipe
    unless RUSTICL_ENABLE names another driver."""
    folder = pathlib.Path(os.environ.get("OCL_ICD_VENDORS") or "/etc/OpenCL/vendors")
    rusticl = {"RUSTICL_ENABLE": os.environ.get("RUSTICL_ENABLE", "llvmpipe")}
    found = {file.stem: Implementation(environment={"OCL_ICD_VENDORS": str(file), **rusticl})
             for file in sorted(folder.glob("*.icd"), key=lambda file: (file.stem != "pocl", file))}
    for library in pathlib.Path(os.environ.get("INTEL_OPENCL_RT", "/none")).rglob("libintelocl.so"):
        driver = pathlib.Path(scratch, "intel.icd")
        driver.write_text(f"{library}\n")
        found["intel"] = Implementation(environment={"OCL_ICD_VENDORS": str(driver)})
    if shutil.which("oclgrind"):
        # optimized code contains calls of LLVM that Oclgrind 21.10 does not know
        found["oclgrind"] = Implementation(["oclgrind", "--build-options", "-cl-opt-disable"], {}, FEW_CASES)
    return found


def glint(*arguments, implementation=Implementation(), seconds=None, gibibytes=None):
    """Returns what glint printed. Raises Failure if its exit status is neither 0 nor EXIT_CHECK, or after `seconds`."""
    def limit():
        if gibibytes:
            resource.setrlimit(resource.RLIMIT_AS, (int(gibibytes * 2**30),) * 2)

    command = [*implementation.prefix, GLINT, *map(str, arguments)]
    process = subprocess.Popen(command, env={**os.environ, **implementation.environment},
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=limit)
    try:
        output, errors = process.communicate(timeout=seconds)
    except BaseException as stop:  # Ctrl-C reaches only this process's group
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # Oclgrind's glint is a separate process
        process.communicate()
        if isinstance(stop, subprocess.TimeoutExpired):
            raise TimedOut(f"timed out after {seconds:g} s") from None
        raise
    if process.returncode not in (0, EXIT_CHECK):
        last = (errors.strip().splitlines() or ["no message"])[-1]
        raise Failure(f"glint {arguments[0]}: exit status {process.returncode}: {last[:100]}")
    return output


def glint_json(*arguments, **limits):
    output = glint(*arguments, "--json", **limits)
    try:
        return json.loads(output)
    except ValueError:
        raise Failure(f"glint {arguments[0]}: the output is not JSON: {output[:60]!r}") from None


def seeds_read(text):
    """Yields the numbers of a list of numbers and ranges, such as 1-4,7."""
    for part in text.split(","):
        first, _, last = part.partition("-")
        yield from range(int(first), int(last or first) + 1)


def report_write(path, report):
    with open(path or os.devnull, "w") as file:
        file.write(json.dumps(report, indent=1) + "\n")
