#!/usr/bin/env -S python3 -B
"""Tests renders and reports that fail or are interrupted: the exit status, the message, and that an earlier image stays unchanged."""
import contextlib
import os
import re
import resource
import signal
import subprocess
import time
import unittest
from pathlib import Path

from glint import PROGRAM, SPHERE, TestCase, main, need_device, read, write

SMALL = "--size 8x6 --quiet"


def writes_here(process):
    """Returns whether a process has a file of this folder open for writing, with a name or without."""
    for link in Path(f"/proc/{process}/fd").glob("*"):
        with contextlib.suppress(OSError):  # it may be closed meanwhile
            flags = int(re.search(r"flags:\s*(\d+)", read(f"/proc/{process}/fdinfo/{link.name}"))[1], 8)
            if os.path.dirname(os.path.realpath(link)) == os.getcwd() and flags & (os.O_WRONLY | os.O_RDWR):
                return True
    return False


class Failures(TestCase):
    """A failure leaves an earlier image unchanged, and nothing next to it."""

    files = {"sphere.yaml": SPHERE, "rays": "0 0 -4  0 0 1\n"}

    def fails(self, arguments, status=1):
        write("old.png", "an earlier image")
        self.refuses(f"render {arguments} -o old.png", "glint: |error: ", status)
        self.assertEqual(read("old.png"), "an earlier image")
        self.nothing_left("*.??????")

    def test_mistakes(self):
        write("bad.yaml", "camera: 5\n")
        self.fails("bad.yaml")
        self.fails("sphere.yaml --bits 9")
        self.fails("sphere.yaml --size 8x6 --region 0,0,9,9")
        self.fails("sphere.yaml --device toaster")
        if os.getuid() != 0:
            os.chmod("old.png", 0o444)
            self.refuses(f"render sphere.yaml {SMALL} -o old.png", "old.png")

    @unittest.skipUnless(os.path.exists("/dev/full"), "there is no /dev/full")
    def test_full_disk(self):
        os.symlink("/dev/full", "full.png")
        self.refuses(f"render sphere.yaml {SMALL} -o full.png", "cannot write")
        os.symlink("/dev/full", "old.t.npy")
        self.fails(f"sphere.yaml {SMALL} --aov t")
        with open("/dev/full", "w", encoding="utf-8") as full:
            errors = self.glint("trace sphere.yaml --rays rays", status=2, stdout=full).stderr
        self.assertEqual(errors.count("\n"), 1)
        # the report is longer than a buffer
        errors = self.glint("devices --probe --format json --output /dev/full", status=1).stderr
        self.assertEqual(errors, "glint: error: cannot write '/dev/full': No space left on device\n")
        bench = "bench sphere.yaml --size 8x6 --seconds 0.05 --no-build-times --format json --output"
        self.glint(f"{bench} old.json")
        self.glint(f"{bench} /dev/full --compare old.json", status=1)

    def test_limit_on_the_size_of_files(self):
        self.glint("render sphere.yaml --size 1000x1000 --quiet -o warm.png")  # the kernel is in the cache then
        limit = 1024 * 1024, 1024 * 1024
        self.refuses("render sphere.yaml --size 1000x1000 --quiet -o limit.ppm", r"limit\.ppm.*File too large",
                     preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit))
        self.nothing_left("*limit*")

    def test_reader_goes_away(self):
        """A message and a status, not a signal, end the program."""
        closed, writer = os.pipe()
        os.close(closed)
        self.glint("check sphere.yaml", status=2, stdout=writer)
        os.close(writer)

        write("rays", "".join(f"{i} 0 -4 0 0 1\n" for i in range(100000)))
        with subprocess.Popen(["head", "-n", "1"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as head:
            errors = self.glint("trace sphere.yaml --rays rays", status=2, stdout=head.stdin).stderr
        self.assertRegex(errors, r"^glint: .*standard output: Broken pipe\n\Z")

        os.mkfifo("pipe.ppm")
        with subprocess.Popen(["head", "-c", "10", "pipe.ppm"], stdout=subprocess.DEVNULL):
            self.refuses("render sphere.yaml --size 400x300 --quiet --aov t -o pipe.ppm", r"pipe\.ppm.*Broken pipe")
        self.nothing_left("*pipe.t*")

    def test_signals(self):
        """A signal ends a long render, and a second one right after it changes nothing."""
        self.glint(f"render sphere.yaml {SMALL} -o warm.png")
        command = [PROGRAM, *"render sphere.yaml --size 20000x20000 --samples 64 -o long.png".split()]
        for signals in (signal.SIGINT,), (signal.SIGINT, signal.SIGINT), (signal.SIGTERM,), (signal.SIGHUP,):
            with self.subTest(signals):
                write("long.png", "an earlier image")
                render = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
                deadline = time.monotonic() + 120
                while not writes_here(render.pid) and render.poll() is None and time.monotonic() < deadline:
                    time.sleep(0.05)
                self.assertTrue(writes_here(render.pid), "it never began to write")
                for number in signals:
                    render.send_signal(number)
                    time.sleep(0.01)
                errors = render.communicate(timeout=120)[1]
                self.assertEqual(render.returncode, 130, errors)
                self.assertRegex(errors, "interrupted")
                self.assertIn("long.png", errors)
                self.assertEqual(read("long.png"), "an earlier image")
                self.nothing_left("long.png.*")

    def test_images_too_large(self):
        """An image that cannot fit on the disk is refused. Otherwise the first bands tell how long it takes."""
        for name in "vast.ppm", "vast.npy":
            self.refuses(f"render sphere.yaml --size 1048576x1048576 --quiet -o {name}", r"it has \d+\.0 TiB or more, and its disk has \S+ [KMGT]iB left")
        self.nothing_left("vast.*")
        os.symlink("/dev/null", "null.png")
        command = [PROGRAM, *"render sphere.yaml --size 1048576x1048576 -o null.png".split()]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as render:
            self.assertRegex(render.stderr.readline(), r"^glint: 1048576 x 1048576 pixels: about \d+ (hour|day)s and at most 3.0 TiB\n")
            render.send_signal(signal.SIGINT)
            self.assertIn("interrupted", render.communicate(timeout=120)[1])
        self.assertEqual(render.returncode, 130)

    def test_signals_before_the_render(self):
        """A signal while the scene is read ends glint like later ones. One that is ignored stays ignored."""
        os.mkfifo("slow.yaml")
        command = [PROGRAM, *f"render slow.yaml {SMALL} -o slow.png".split()]
        for number in signal.SIGINT, signal.SIGTERM, signal.SIGHUP:
            for ignored in False, True:
                with self.subTest(number=number, ignored=ignored):
                    before = signal.signal(number, signal.SIG_IGN if ignored else signal.SIG_DFL)
                    render = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
                    signal.signal(number, before)
                    with open("slow.yaml", "w", encoding="utf-8") as scene:  # waits until glint reads
                        render.send_signal(number)
                        if ignored:
                            scene.write(SPHERE)
                        else:
                            render.wait(timeout=120)
                    errors = render.communicate(timeout=120)[1]
                    self.assertEqual(render.returncode, 0 if ignored else 130, errors)
                    self.assertEqual(errors, "" if ignored else "glint: interrupted\n")
        self.nothing_left("slow.png.*")

    def test_scene_files_are_not_overwritten(self):
        write("globe.png", "P3 1 1 255 9 9 9\n")
        write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        write("globe.yaml", SPHERE.replace("reflection: 0.1", "image: globe.png") + "  - mesh: {file: mesh.obj}\n")
        files = {name: read(name) for name in ("globe.png", "mesh.obj", "globe.yaml")}
        os.symlink("globe.yaml", "link.png")
        os.link("globe.png", "hard.t.npy")
        os.mkdir("globe")
        for arguments, path in (
            ("", "globe.png.*-o"),
            ("-o globe/../globe.png", "globe/../globe.png"),
            ("-o link.png", "link.png"),
            ("--aov normal,t -o hard.png", "hard.t.npy"),
        ):
            self.refuses(f"render globe.yaml {SMALL} {arguments}", f"would overwrite '{path}")
        self.refuses("trace globe.yaml --rays rays -o mesh.obj", "would overwrite 'mesh.obj'")
        write("a.yaml", SPHERE)
        write("b.yaml", SPHERE.replace("reflection: 0.1", "image: a.png"))
        os.link("globe.png", "a.png")
        for scenes in "a.yaml b.yaml", "b.yaml a.yaml":
            self.refuses(f"render {scenes} {SMALL}", "the output would overwrite 'a.png', from which 'b.yaml' is read")
            self.assertFalse(os.path.exists("b.png"))
        self.assertEqual({name: read(name) for name in files}, files)
        self.glint(f"render globe.yaml {SMALL} -o globe/other.png")
        os.remove("globe.png")
        os.mkdir("globe.png")
        self.refuses("check globe.yaml", r"^globe\.yaml:\d+:\d+: error: .*'globe\.png': not a regular file")
        os.rmdir("globe.png")
        self.refuses("check globe.yaml", r"^globe\.yaml:\d+:\d+: error: .*'globe\.png': No such file")


if __name__ == "__main__":
    need_device()
    main()
