#!/usr/bin/env -S python3 -B
"""Tests glint-mpi. The image of several ranks must have the bytes of one process's. Errors of any rank must end the job with a
message. A killed rank must end it, and its checkpoint can be resumed. A rank whose device fails, or that sends nonsense, is
left out.

run_tests: sanitize-long-only
run_tests: first"""
import json
import os
import shlex
import shutil
import signal
import subprocess
import time
from pathlib import Path

from glint import BUILD, FAULTS_LIBRARY, IS_LONG, IS_SANITIZED, POCL, PROGRAM, ROOT, SPHERE, TWO, TestCase, checkpoint_rows, file_size, main, need_pocl, plain, png_read, read, shim_build, skip_all, write

MPI = POCL | {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "HWLOC_COMPONENTS": "-gl",  # else an X server that ends takes mpirun with it
              "OMPI_MCA_mpi_yield_when_idle": "1",  # ranks that wait leave the processor to other tests
              # more ranks than processors, in Open MPI 4 and in 5
              "OMPI_MCA_rmaps_base_oversubscribe": "1", "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe"}
RANKS = PROGRAM.parent / "glint-mpi"
RENDER = "render sphere.yaml --size 64x96 --samples 20 --quiet"


# Faults of a rank. Its device has so few bytes of memory, its second device has another driver, it is interrupted as it reads a
# scene, or it is killed as it learns whether all see the files. Or data that it sends with the tag FAULT_TAG has a wrong word, is
# sent FAULT_TIMES, or is replaced by an end
# without a reason (FAULT_ENDS).
FAULTS = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <mpi.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
int clGetDeviceInfo(void *device, unsigned name, size_t size, void *value, size_t *value_size)
{
    const int status = ((int (*)())dlsym(RTLD_NEXT, "clGetDeviceInfo"))(device, name, size, value, value_size);
    const int is_memory = name == 0x101F || name == 0x1010; // CL_DEVICE_GLOBAL_MEM_SIZE, CL_DEVICE_MAX_MEM_ALLOC_SIZE
    static void *first;
    if (!first) first = device;
    const int is_version = name == 0x102D; // CL_DRIVER_VERSION
    if (getenv("FAULT_REFERENCE") && value && is_version && device != first) *(char *)value = '?';
    if (getenv("FAULT_MEMORY") && value && is_memory) *(unsigned long long *)value = atoi(getenv("FAULT_MEMORY"));
    return status;
}
FILE *fopen(const char *path, const char *mode)
{
    if (getenv("FAULT_INTERRUPTS") && strstr(path, ".yaml")) raise(SIGTERM);
    return ((FILE * (*)()) dlsym(RTLD_NEXT, "fopen"))(path, mode);
}
FILE *fopen64(const char *path, const char *mode) // where a library's flags ask for large files
{
    return fopen(path, mode);
}
int MPI_Allreduce(const void *bytes, void *result, int count, MPI_Datatype type, MPI_Op operation, MPI_Comm ranks)
{
    if (getenv("FAULT_KILLED")) raise(SIGKILL);
    return PMPI_Allreduce(bytes, result, count, type, operation, ranks);
}
int MPI_Send(const void *bytes, int size, MPI_Datatype type, int rank, int tag, MPI_Comm ranks)
{
    const char *fault_tag = getenv("FAULT_TAG");
    unsigned words[64];
    if (!fault_tag || tag != atoi(fault_tag)) return PMPI_Send(bytes, size, type, rank, tag, ranks);
    if (getenv("FAULT_ENDS")) {
        PMPI_Send(memset(words, 0, sizeof words), sizeof words, type, rank, 5, ranks);
        MPI_Finalize();
        _exit(0);
    }
    if (getenv("FAULT_TIMES")) {
        for (int i = 0; i < atoi(getenv("FAULT_TIMES")); i++)
            PMPI_Send(bytes, size, type, rank, tag, ranks);
        return 0;
    }
    memcpy(words, bytes, size);
    words[atoi(getenv("FAULT_WORD"))] = strtoul(getenv("FAULT_VALUE"), NULL, 0);
    return PMPI_Send(words, size - atoi(getenv("FAULT_CUT")), type, rank, tag, ranks);
}
"""
TAKE, BAND, LAYERS = 0, 2, 3  # tags


def wrong_word(tag, word, value, cut=0):
    """Returns the variables for a wrong word in what is sent with the tag, with `cut` bytes cut off the end."""
    return {"FAULT_TAG": tag, "FAULT_WORD": word, "FAULT_VALUE": value, "FAULT_CUT": cut}


FAULTY = [
    wrong_word(TAKE, 1, 0), wrong_word(BAND, 0, 64, 8),
    {"FAULT_TAG": TAKE, "FAULT_TIMES": 2}, {"FAULT_TAG": LAYERS, "FAULT_TIMES": 0}, {"FAULT_TAG": BAND, "FAULT_ENDS": 1},
]
if IS_LONG:
    FAULTY += [wrong_word(TAKE, 0, 8, 4), wrong_word(BAND, 1, 1), wrong_word(BAND, 6, 0xFF), wrong_word(TAKE, 0, 0), wrong_word(BAND, 0, 65), wrong_word(BAND, 2, 0xFFFFFFFF), wrong_word(BAND, 4, 8),
               {"FAULT_TAG": BAND, "FAULT_TIMES": 2}, {"FAULT_TAG": BAND, "FAULT_TIMES": 0}, {"FAULT_TAG": LAYERS, "FAULT_TIMES": 2}]
SLOW = {"GLINT_FAULTS": "'clEnqueueNDRangeKernel sleep=200'"}  # so that the other rank gets rows
FAILING = {"GLINT_FAULTS": "'clEnqueueNDRangeKernel fail'"}


def faulty(variables):
    """Returns the start of a command of a rank with these faults."""
    texts = " ".join(f"{name}={value}" for name, value in variables.items())
    return f"env LD_PRELOAD='{FAULTS_LIBRARY} ./ranks.so' {texts} {RANKS}"


def environment():
    return {name: value for name, value in os.environ.items() if name != "GLINT_DEVICE"} | MPI | {"LC_ALL": "C"}


class Mpi(TestCase):
    files = {"sphere.yaml": SPHERE}

    def mpirun(self, arguments, status=0):
        process = subprocess.run(["mpirun", *shlex.split(arguments)], env=environment(), stdin=subprocess.DEVNULL,
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
        self.assertEqual(process.returncode, status, f"mpirun {arguments}: {process.stderr}")
        return process

    def mpirun_each(self, *commands, status=0):
        """Runs a command per rank, chosen in a shell, since mpirun's way with colons crashes in Open MPI 5.0."""
        choices = "".join(f"{rank}) exec {command} ;;\n" for rank, command in enumerate(commands))
        write("rank.sh", f"case $OMPI_COMM_WORLD_RANK in\n{choices}esac\n")
        return self.mpirun(f"-n {len(commands)} sh rank.sh", status)

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

    def test_certified(self):
        """The pixels that any rank re-renders in double count. The other rank has no file of the scene's."""
        write("sphere.yaml", SPHERE + SPHERE.splitlines()[-1])  # which of two equal ones is nearer is uncertain
        command = f"{RENDER} --precision certified --timing=json"
        one = self.json(f"{command} -o one.npy", env=POCL)
        ranks = json.loads(self.mpirun_each(f"{RANKS} {command} -o ranks.npy", f"env -C / {RANKS} {command} -o ranks.npy").stdout)
        self.assertSameBytes("one.npy", "ranks.npy")
        self.assertGreater(one["uncertified_samples"], 0)
        for key in "rerendered_samples", "uncertified_samples":
            self.assertEqual(ranks[key], one[key])

    def test_mixed_lanes(self):
        """Each rank gets the BVH for its lanes."""
        for lanes in 1, 16:
            command = f"render {plain('spheres16.yaml')} --size 64x48 --bvh on --lanes {lanes} --precision strict --quiet"
            self.glint(f"{command} -o one.npy", env=POCL)
            self.mpirun(f"-n 2 {RANKS} {command} -o ranks.npy")
            self.assertSameBytes("one.npy", "ranks.npy")

    def test_errors(self):
        self.assertRegex(self.mpirun(f"-n 2 {RANKS} bench sphere.yaml", 1).stderr, "usage: mpirun")
        self.assertRegex(self.mpirun(f"-n 2 {RANKS} {RENDER} --sizes 3", 1).stderr, "unrecognized option")
        self.assertRegex(self.mpirun(f"-n 2 {RANKS} render none.yaml", 1).stderr, "none.yaml")
        self.assertRegex(self.mpirun(f"-n 2 {RANKS} {RENDER} -o /nowhere/image.png", 1).stderr, "cannot create '/nowhere/image.png'")
        process = self.mpirun_each(f"{RANKS} {RENDER}", f"env OCL_ICD_VENDORS=/none {RANKS} {RENDER}", status=1)
        self.assertRegex(process.stderr, "rank 1 on .*: no OpenCL device")
        process = self.mpirun(f"-n 2 {RANKS} {RENDER} --precision certified --reference-device none", 1)
        self.assertRegex(process.stderr, "rank 1 on .*: no suitable reference device")
        process = self.mpirun(f"-n 1 env OCL_ICD_VENDORS=/none {RANKS} {RENDER}", 1)
        self.assertEqual(process.stderr.count("no OpenCL device"), 1, process.stderr)

    def faults_build(self):
        flags = subprocess.run(["pkg-config", "--cflags", "ompi-c"], stdout=subprocess.PIPE, text=True, check=True).stdout.split()
        shim_build("ranks.so", FAULTS, *flags)
        self.glint(f"{RENDER} -o one.npy", env=POCL)

    def write_frames(self, more=(), status=0):
        """Writes six scenes and `more`, renders them into expected/, and returns the command that does so."""
        scenes = dict(more) | {f"sphere{i}": SPHERE.replace("radius: 1", f"radius: 1.{i}") for i in range(6)}
        for name, text in scenes.items():
            write(f"{name}.yaml", text)
        os.mkdir("expected")
        command = f"render {' '.join(f'{name}.yaml' for name in scenes)} --size 160x120 --precision strict --quiet"
        self.glint(f"{command} -o expected", status, env=POCL)
        return command

    def check_frames(self, together=()):
        """Checks that frames are as expected and that those that the ranks rendered together name the ranks."""
        self.assertEqual(sorted(os.listdir("frames")), sorted(os.listdir("expected")))
        for name in os.listdir("frames"):
            _, rows, texts, _ = png_read(f"frames/{name}")
            self.assertEqual(rows, png_read(f"expected/{name}")[1])
            self.assertEqual("Ranks" in texts, together is all or name in together, name)
        shutil.rmtree("frames")
        os.mkdir("frames")

    def test_frames_of_an_animation(self):
        """Each rank has its frames and their checkpoints, and all share the last frame. Those that exist are kept. With reports on
        standard output all share each frame."""
        write("moving.yaml", SPHERE.replace("radius: 1", "radius: {keys: {0: 1, 4: 2}}"))
        command = "render moving.yaml --size 64x48 --precision strict --frames 0-4"
        self.glint(f"{command} --quiet -o one%d.npy", env=POCL)
        write("ranks1.npy", "kept")
        process = self.mpirun(f"-n 2 {RANKS} {command} --skip-existing --checkpoint saved%d -o ranks%d.npy")
        self.assertEqual(process.stderr.count("glint: kept ranks1.npy\n"), 1)
        for frame in 0, 2, 3, 4:
            self.assertSameBytes(f"one{frame}.npy", f"ranks{frame}.npy")
        self.assertEqual(list(Path().glob("saved*")), [])
        process = self.mpirun(f"-n 2 {RANKS} {command} -o ranks%d.npy --timing=json")
        reports = [json.loads(line) for line in process.stdout.splitlines()]
        self.assertEqual([(report["frame"], len(report["by_rank"])) for report in reports], [(frame, 1) for frame in range(5)])

    def test_frames_of_another_camera(self):
        """All ranks share each frame if one sees another file of --camera."""
        write("moving.yaml", SPHERE.replace("radius: 1", "radius: {keys: {0: 1, 4: 2}}"))
        os.mkdir("other")
        for path, x in ("camera.yaml", 0), ("other/camera.yaml", 1):
            write(path, f"camera: {{position: [{x}, 0, -6], look_at: [0, 0, 0]}}\nobjects: []\n")
        here = Path.cwd()
        command = f"render {here}/moving.yaml --camera camera.yaml --size 64x48 --precision strict --frames 0-3"
        self.glint(f"{command} --quiet -o one%d.npy", env=POCL)
        ranks = f"{RANKS} {command} -o {here}/ranks%d.npy"
        self.mpirun_each(ranks, f"env -C other {ranks}")
        for frame in range(4):
            self.assertSameBytes(f"one{frame}.npy", f"ranks{frame}.npy")

    def test_motion_blur(self):
        """Motion is blurred in a frame that one rank renders and in one that all render."""
        write("moving.yaml", "shutter: 0.5\n" + SPHERE.replace("radius: 1", "radius: {keys: {0: 1, 4: 2}}"))
        command = "render moving.yaml --size 64x48 --precision strict --frames 0-2 --samples 5"
        self.glint(f"{command} --quiet -o one%d.npy", env=POCL)
        self.mpirun(f"-n 2 {RANKS} {command} -o ranks%d.npy")
        for frame in range(3):
            self.assertSameBytes(f"one{frame}.npy", f"ranks{frame}.npy")

    def test_frames(self):
        """Each rank renders whole frames, and all together the rest, or all frames if one sees other files or has other options. A
        mistake ends one frame."""
        command = self.write_frames({"bad": "camera: 5", "many": read(plain("spheres16.yaml"))}.items(), 1)
        os.mkdir("frames")
        self.assertRegex(self.mpirun(f"-n 3 {RANKS} {command} -o frames", 1).stderr, "(?m)^bad.yaml:1")
        self.check_frames(["sphere4.png", "sphere5.png"])
        others = [f"env -C / {RANKS} {command} -o frames", f"{RANKS} {command} -o frames --samples 2"]
        for other in others if IS_LONG else others[:1]:
            self.mpirun_each(f"{RANKS} {command} -o frames", other, other, status=1)
            self.check_frames(all)

    def test_options_for_one_process(self):
        """They are refused before any frame is rendered."""
        write("moving.yaml", SPHERE.replace("radius: 1", "radius: {keys: {0: 1, 4: 2}}"))
        for option in "--work-group 2x2", "--build-options=-DUNUSED", "--capture launches":
            for command in RENDER, "render moving.yaml --size 64x48 --frames 0-2 -o frame%d.png":
                process = self.mpirun(f"-n 2 {RANKS} {command} {option}", status=1)
                self.assertIn("--work-group, --build-options and --capture need glint render, a single process", process.stderr)
            self.assertEqual(list(Path().glob("frame*")), [])

    def test_a_refused_checkpoint(self):
        """A refused checkpoint ends all ranks."""
        Path("saved").write_text("no checkpoint")
        self.mpirun(f"-n 2 {RANKS} {RENDER} --checkpoint saved", status=1)

    def test_a_checkpoint_of_another_reference_device(self):
        """It is refused, whichever rank has that device."""
        self.faults_build()
        options = f"{RENDER} -o ranks.npy --precision certified --device 0 --reference-device 1 --checkpoint saved"
        two = {"POCL_DEVICES": "'pthread pthread'"}
        self.glint(options.partition(" --checkpoint")[0], env=TWO)  # else its launches for the passports fail before there is a checkpoint
        command, failing, other = (f"{faulty(two | faults)} {options}" for faults in ({}, FAILING, {"FAULT_REFERENCE": 1}))
        self.mpirun_each(failing, failing, status=2)
        self.assertTrue(os.path.exists("saved"))
        process = self.mpirun_each(command, other, status=1)
        self.assertRegex(process.stderr, r"'saved' belongs to another image \(device: ")
        self.mpirun_each(command, command)

    def test_frames_of_failing_devices(self):
        """Other ranks render the frame of a rank whose device fails. If no rank is left, the job exits with status 2."""
        self.faults_build()
        command = self.write_frames()
        os.mkdir("frames")
        ranks = [f"{faulty(fault)} {command} -o frames" for fault in (SLOW, FAILING)]
        for first, second in ranks, reversed(ranks):
            process = self.mpirun_each(first, second)
            self.assertRegex(process.stderr, "warning: clEnqueueNDRangeKernel.*; the other devices render its share")
            self.check_frames()
        process = self.mpirun_each(ranks[1], ranks[1], status=2)
        self.assertRegex(process.stderr, "no rank is left that can render")
        self.assertEqual(os.listdir("frames"), [])

    def test_a_frame_that_fits_no_device(self):
        """Only that frame is left out, with a message, whichever rank has it last."""
        self.faults_build()
        command = self.write_frames({"large": SPHERE + 4000 * SPHERE.splitlines(keepends=True)[-1]}.items())
        os.remove("expected/large.png")
        os.mkdir("frames")
        small = f"{faulty({'FAULT_MEMORY': 131072})} {command} -o frames"
        process = self.mpirun(f"-n 2 {small}", 1)
        self.assertRegex(process.stderr, "the scene needs .* on the device")
        self.check_frames()

    def test_an_interrupt_while_a_frame_is_read(self):
        """An interrupt of the first rank also ends the other rank's frame, and nothing is left behind."""
        self.faults_build()
        command = self.write_frames()
        os.mkdir("frames")
        interrupted = f"{faulty({'FAULT_INTERRUPTS': 1})} {command} -o frames"
        process = self.mpirun_each(interrupted, f"{RANKS} {command} -o frames", status=130)
        self.assertRegex(process.stderr, "glint: interrupted: no image was written; an earlier frames/")
        self.assertEqual([name for name in os.listdir("frames") if not name.endswith(".png")], [])

    def test_a_kill_while_files_are_compared(self):
        """The next run removes the file by which the ranks learn whether they share the images' folder."""
        self.faults_build()
        command = self.write_frames()
        shutil.copytree("expected", "frames")
        ranks = f"{RANKS} {command} -o frames"
        write("rank.sh", f"test $OMPI_COMM_WORLD_RANK != 0 || exec {faulty({'FAULT_KILLED': 1})} {command} -o frames\nexec {ranks}\n")
        killed = subprocess.run(["mpirun", "-n", "2", "sh", "rank.sh"], env=environment(), stdin=subprocess.DEVNULL, capture_output=True, timeout=120, check=False)
        self.assertNotEqual(killed.returncode, 0)
        self.assertEqual(len(os.listdir("frames")), len(os.listdir("expected")) + 1)
        self.mpirun(f"-n 2 {ranks}")
        self.check_frames()

    def mpirun_faulty(self, *faults, status=0):
        """Runs a job in which each rank has the faults of its variables."""
        process = self.mpirun_each(*(f"{faulty(fault)} {RENDER} -o ranks.npy" for fault in faults), status=status)
        if status == 0:
            self.assertSameBytes("one.npy", "ranks.npy")
            os.remove("ranks.npy")
        self.assertFalse(os.path.exists("ranks.npy"))
        return process.stderr

    def test_failing_devices(self):
        """The other ranks render the rows of a rank whose device fails. If no rank is left, the job exits with status 2."""
        self.faults_build()
        self.assertRegex(self.mpirun_faulty(SLOW, FAILING), "warning: rank 1 on .*: clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES.*; the other ranks render its rows")
        self.assertRegex(self.mpirun_faulty(FAILING, SLOW), "warning: clEnqueueNDRangeKernel.*; the other devices render its share")
        self.assertRegex(self.mpirun_faulty(FAILING, FAILING, status=2), "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES")

    def test_nonsense(self):
        """Everything that a rank sends is checked."""
        self.faults_build()
        for fault in FAULTY:
            with self.subTest(fault=fault):
                self.assertRegex(self.mpirun_faulty(SLOW, fault), "warning: rank 1 on .*: sent an unexpected message; the other ranks")

    def start(self, command, patience=1):
        """Starts a job with a checkpoint, whose ranks write their errors to `errors`, since an interrupted mpirun of Open MPI 5
        prints none. Returns when the checkpoint has another band, or the job is done.

        `patience`: the seconds for which mpirun waits before it ends a rank, and again before it kills it.
        """
        before = max(file_size("saved"), 4096)
        write("rank.sh", f"exec {RANKS} {command} -o ranks.npy --checkpoint saved 2>>errors\n")
        process = subprocess.Popen(["mpirun", "--mca", "odls_base_sigkill_timeout", str(patience), "-n", "3", "sh", "rank.sh"],
                                   env=environment(), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and file_size("saved") <= before:
            time.sleep(0.001)
        return process

    def ranks_of(self, process):
        """Returns the process of each rank."""
        ranks = {}
        for children in Path(f"/proc/{process.pid}/task").glob("*/children"):
            for child in children.read_text(encoding="utf-8").split():
                variables = Path(f"/proc/{child}/environ").read_text(encoding="utf-8").split("\0")
                ranks |= {int(text.split("=")[1]): int(child) for text in variables if text.startswith("OMPI_COMM_WORLD_RANK=")}
        return ranks

    def test_interrupts(self):
        """An interrupt of mpirun, which then exits with a different status, or of the first rank alone ends the job."""
        command = f"{RENDER.replace('20', '100000').replace('64x96', '64x4096')} --precision strict"  # minutes
        ways = ("mpirun", signal.SIGINT, None), ("rank", signal.SIGTERM, 130)
        version = subprocess.run(["mpirun", "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout
        # Open MPI 6.0.0rc2 kills its ranks at once
        for interrupted, signal_number, status in ways[" 6.0.0rc" in version:]:
            process = self.start(command, patience=4)  # a second is too short while other tests run
            self.assertIsNone(process.poll(), "it was done before the interrupt")
            os.kill(process.pid if interrupted == "mpirun" else self.ranks_of(process)[0], signal_number)
            process.wait(timeout=60)
            errors = read("errors")
            os.remove("errors")
            self.assertRegex(errors, "glint: interrupted: no image was written")
            self.assertRegex(errors, "run the same command again to continue; finished bands are in 'saved'")
            self.assertNotEqual(process.returncode, 0)
            if status:
                self.assertEqual(process.returncode, status)
            self.assertGreater(os.stat("saved").st_size, 4096)
            self.assertFalse(os.path.exists("ranks.npy"))

    def test_a_killed_rank(self):
        command = f"{RENDER.replace('20', '5000')} --precision strict"
        self.glint(f"{command} -o one.npy", env=POCL)
        killed = 0
        for kill in range(200 if IS_LONG else 3):
            process = self.start(command)
            rank = self.ranks_of(process).get(kill % 3) if process.poll() is None else None
            if rank:
                os.kill(rank, 9)
            process.wait(timeout=120)
            if process.returncode == 0:
                self.assertSameBytes("one.npy", "ranks.npy")
            killed += process.returncode != 0
        self.assertGreater(killed, 0, "each job was done before one of its ranks was killed")
        saved = checkpoint_rows("saved") / 96
        report = json.loads(self.mpirun(f"-n 3 {RANKS} {command} -o ranks.npy --checkpoint saved --timing=json").stdout)
        self.assertSameBytes("one.npy", "ranks.npy")
        self.assertAlmostEqual(sum(part["share"] for part in report["by_device"] + report["by_rank"]), 1 - saved)
        print(f"{killed} jobs ended by the kill of a rank")
        self.assertFalse(os.path.exists("saved"))


if __name__ == "__main__":
    if not shutil.which("mpirun") or subprocess.run(["pkg-config", "--exists", "ompi-c"], check=False).returncode:
        skip_all("Open MPI is not installed")
    if IS_SANITIZED:
        skip_all("Open MPI leaks")
    need_pocl()
    made = subprocess.run(["make", "-s", "mpi", f"BUILD={os.path.relpath(BUILD, ROOT)}"], cwd=ROOT, check=False)
    if made.returncode:
        raise SystemExit("make mpi failed")
    main()
