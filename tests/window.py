"""Runs glint view in a display of Xvfb with xdotool's mouse and keys, and reads the display, for test_view.py."""
import contextlib
import os
import queue
import re
import shutil
import struct
import subprocess
import tempfile
import threading
import time
from pathlib import Path

from glint import PROGRAM, png_read, skip_all, write

SCENE = """\
camera: {position: [0.5, 1, -4], look_at: [0, 0, 0], fov: 50}
background: [0.125, 0.25, 0.5]
lights: [{point: {position: [3, 4, -5]}}]
objects:
  - mesh: {file: mesh.obj, material: {color: [0.9, 0.8, 0.7]}}
"""
WIDTH, HEIGHT = 160, 120
SAMPLES = 3
DEADLINE = 300  # seconds to wait before a test fails, even on an overloaded machine


@contextlib.contextmanager
def display_open():
    """Runs Xvfb, whose screen is a file in the format of xwd(1).

    By default it resets itself when its last client has gone, and refuses those that come meanwhile.
    """
    read, write_end = os.pipe()
    with tempfile.TemporaryDirectory() as folder:
        command = ["Xvfb", "-noreset", "-nocursor", "-displayfd", str(write_end), "-screen", "0", "320x360x24", "-fbdir", folder]
        process = subprocess.Popen(command, pass_fds=[write_end], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write_end)
        with os.fdopen(read) as file:
            number = file.readline().strip()
        if not number:
            skip_all("Xvfb does not start")
        os.environ |= {"DISPLAY": f":{number}", "VIEW_FOLDER": folder}
        try:
            yield
        finally:
            process.terminate()
            process.wait()


def screen():
    """Returns the width of a row in bytes, and the pixels of the display: blue, green, red, and one unused."""
    data = Path(os.environ["VIEW_FOLDER"], "Xvfb_screen0").read_bytes()
    head = struct.unpack(">25I", data[:100])
    size, row, colors = head[0], head[12], head[19]
    return row, data[size + 12 * colors :]


def xdotool(*arguments):
    return subprocess.run(["xdotool", *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def windows_shown(process):
    """Returns the windows that the process shows."""
    command = ["xdotool", "search", "--onlyvisible", "--pid", str(process)]
    return subprocess.run(command, check=False, capture_output=True, text=True).stdout.split()


def wait_until(condition, otherwise):
    """Polls until the condition holds, sleeping between checks."""
    end = time.monotonic() + DEADLINE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(otherwise)
        time.sleep(0.01)


def png_rows(path):
    """Returns rows of RGB of an 8-bit image, unfiltered."""
    (width, height, _, _), data, _, _ = png_read(path)
    stride, rows, above = 3 * width, [], bytes(3 * width)
    for y in range(height):
        kind, line = data[y * (stride + 1)], bytearray(data[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for x in range(stride):
            left = line[x - 3] if x >= 3 else 0
            corner = above[x - 3] if x >= 3 else 0
            guess = left + above[x] - corner
            paeth = min((abs(guess - left), 0, left), (abs(guess - above[x]), 1, above[x]), (abs(guess - corner), 2, corner))
            line[x] = line[x] + [0, left, above[x], (left + above[x]) // 2, paeth[2]][kind] & 255
        above = bytes(line)
        rows.append(above)
    return rows


class Window:
    """A running glint view, whose lines of output are read as they come."""

    def __init__(self, test, scene="scene.yaml", options="", waits=True, stdin=subprocess.DEVNULL, status=0, **environment):
        self.test, self.status, self.lines = test, status, queue.Queue()
        command = [PROGRAM, "view", scene, "--size", f"{WIDTH}x{HEIGHT}", "--samples", str(SAMPLES), *options.split()]
        # the libraries that SDL loads and unloads leak
        sanitizer = os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0:verify_asan_link_order=0"
        variables = os.environ | {
            "SDL_RENDER_DRIVER": "software", "SDL_VIDEODRIVER": "x11", **environment, "ASAN_OPTIONS": sanitizer}
        self.process = subprocess.Popen(
            command, env=variables, stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        test.addCleanup(self.kill)
        test.addCleanup(self.close)
        self.id = self.shown_at_last()
        xdotool("windowfocus", "--sync", self.id, "windowmove", self.id, 0, 0)
        if waits:
            self.title_at_last(" sample")  # until the scene is loaded, there is no camera

    def shown_at_last(self):
        """Returns the window's number once it is shown."""
        wait_until(lambda: windows_shown(self.process.pid) or self.process.poll() is not None, "no window is shown")
        return (windows_shown(self.process.pid) or self.line("a window"))[0]  # fails with what was printed

    def read(self):
        for line in self.process.stdout:
            self.lines.put(line)
        self.lines.put("")

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.reader.join()
        self.process.stdout.close()

    def line(self, pattern):
        """Returns the next line that matches."""
        seen = []
        while True:
            try:
                line = self.lines.get(timeout=DEADLINE)
            except queue.Empty:
                self.test.fail(f"glint view has not printed {pattern}: {''.join(seen)}")
            seen.append(line)
            if match := re.search(pattern, line):
                return match
            if line == "":
                self.test.fail(f"glint view ended without printing {pattern}: {''.join(seen)}")

    def mouse(self, x, y, *more):
        xdotool("mousemove", "--window", self.id, x, y, *more)

    def key(self, *keys):
        xdotool("key", *keys)

    def drag(self, button, start, *path):
        """Presses a button at the first point, releases it at the last."""
        moves = [word for point in path for word in ("mousemove", "--window", self.id, *point)]
        self.mouse(*start, "mousedown", button, *moves, "mouseup", button)

    def camera(self):
        self.key("c")
        return self.line("^camera: .*")[0]

    def saved(self, key="s"):
        """Saves the image once it is complete, and returns the file's name."""
        self.key(key)
        return self.line("^saved (.*)$")[1]

    def rendered(self, camera, ending="png", size=None):
        """Returns the file that glint render writes with the camera."""
        os.makedirs("rendered", exist_ok=True)
        shutil.copy("mesh.obj", "rendered")
        write("rendered/scene.yaml", re.sub("^camera: .*", camera, SCENE))
        path = f"rendered/image.{ending}"
        width, height = size or (WIDTH, HEIGHT)
        self.test.glint(f"render rendered/scene.yaml --size {width}x{height} --samples {SAMPLES} -o {path}")
        return path

    def check(self, size=None):
        """Checks that the saved image and the display equal glint render's image for the printed camera. Returns the camera."""
        camera = self.camera()
        path = self.rendered(camera, size=size)
        self.test.assertSameBytes(self.saved(), path)
        self.key("x")  # hides the message
        rows = png_rows(path)
        self.shows_at_last(rows)
        return camera

    def pixel(self, x, y):
        stride, pixels = screen()
        return tuple(pixels[y * stride + 4 * x + channel] for channel in (2, 1, 0))

    @staticmethod
    def most_colors_of_a_column(columns, rows):
        stride, pixels = screen()
        return max(len({pixels[y * stride + 4 * x : y * stride + 4 * x + 3] for y in rows}) for x in columns)

    def frame(self):
        """Returns the frame of the animation from the title."""
        return int(re.search(", frame (.*?) of ", xdotool("getwindowname", self.id))[1])

    def title_at_last(self, text):
        wait_until(lambda: text in xdotool("getwindowname", self.id), f"the title has no '{text}'")

    def shows_at_last(self, rows):
        wait_until(lambda: self.shows(rows), "the display does not show the image")

    def shows(self, rows):
        stride, pixels = screen()
        for y, row in enumerate(rows):
            line = pixels[y * stride : y * stride + len(row) // 3 * 4]
            if (line[2::4], line[1::4], line[0::4]) != (row[0::3], row[1::3], row[2::3]):
                return False
        return True

    def message_at_last(self):
        """Waits until a message is shown, in white."""
        wait_until(lambda: b"\xff\xff\xff" in screen()[1], "no message is shown")

    def changes_at_last(self, before):
        wait_until(lambda: screen() != before, "the display does not change")

    def close(self):
        """Closes the window, which each test does at its end. The program must end with the status."""
        if self.process.poll() is None:
            self.key("Escape")
        self.test.assertEqual(self.process.wait(DEADLINE), self.status)
