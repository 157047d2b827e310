#!/usr/bin/env -S python3 -B
"""Tests glint view in a display of Xvfb with xdotool's mouse and keys. What the display shows and what is saved must be the
bits that glint render writes with the camera that is printed.

Nothing here depends on time: a test waits until glint has printed or shown what it must.
"""
import os
import random
import re
import shutil
import signal
from pathlib import Path

from glint import IS_LONG, ROOT, TestCase, faults, main, need_device, npy_read, png_read, read, run, shim_build, skip_all, write
from window import DEADLINE, HEIGHT, SAMPLES, SCENE, WIDTH, Window, display_open, png_rows, screen, wait_until, windows_shown, xdotool

FRAMES = 8
ANIMATION = f"frames: {FRAMES}\n" + SCENE.replace("[0.5, 1, -4]", "{keys: {0: [0.5, 1, -4], 7: [2, 1, -3]}}").replace(
    "[0.9, 0.8, 0.7]", "{keys: {0: [0.9, 0.8, 0.7], 7: [0.1, 0.5, 0.9]}}")
MESH = """\
v 0 -1 -1
v 1 1 0
v -1 1 0
v 0 -1 1
f 1 2 3
f 1 3 4
f 4 2 1
"""


def numbers(camera, name):
    return [float(word) for word in re.search(rf"\b{name}: \[(.*?)\]", camera)[1].split(",")]


class View(TestCase):
    def setUp(self):
        super().setUp()
        write("scene.yaml", SCENE)
        write("mesh.obj", MESH)

    def test_movement(self):
        window = Window(self)
        first = window.check()
        self.assertEqual(first, re.match("camera: .*(?=})", SCENE)[0].replace(", fov", ", up: [0, 1, 0], fov") + "}")
        steps = {
            "orbit": lambda: window.drag(1, (80, 60), (90, 62), (100, 70)),
            "pan": lambda: (xdotool("keydown", "shift"), window.drag(1, (80, 60), (70, 50)), xdotool("keyup", "shift")),
            "dolly": lambda: window.mouse(80, 60, "click", 4),
            "look around": lambda: window.drag(3, (80, 60), (60, 50)),
            "arrows": lambda: window.key("Left", "Up"),
        }
        cameras = {"first": first}
        camera = first
        for name, act in steps.items():
            with self.subTest(name):
                act()
                self.assertNotEqual(window.camera(), camera, "the step does not move the camera")
                cameras[name] = camera = window.check()
        self.assertEqual(numbers(cameras["look around"], "position"), numbers(cameras["dolly"], "position"))
        self.assertEqual(numbers(cameras["arrows"], "look_at"), numbers(cameras["look around"], "look_at"))
        window.key("r")
        self.assertEqual(window.camera(), first)
        xdotool("mousemove", "--window", window.id, 80, 60, "mousedown", 3, "keydown", "w")
        position = numbers(first, "position")
        while numbers(window_camera_in_flight(window), "position") == position:
            pass

    def test_double_click(self):
        """The camera looks at the point, however far apart a busy machine makes the clicks."""
        window = Window(self, SDL_MOUSE_DOUBLE_CLICK_TIME=str(1000 * DEADLINE))
        first = window.check()
        window.mouse(90, 50, "click", "--repeat", 2, 1)
        camera = window.check()
        self.assertEqual(numbers(camera, "position"), numbers(first, "position"))
        self.assertNotEqual(numbers(camera, "look_at"), numbers(first, "look_at"))

    def test_resize_and_save(self):
        window = Window(self)
        xdotool("windowsize", window.id, 101, 73)
        window.title_at_last("101x73")
        camera = window.check((101, 73))
        path = window.saved("shift+s")
        self.assertEqual(path, "scene-1.exr")
        self.assertSameBytes(path, window.rendered(camera, "exr", (101, 73)))
        self.assertEqual(window.saved(), "scene-2.png")
        xdotool("windowunmap", "--sync", window.id, "windowmap", "--sync", window.id, "windowfocus", window.id)
        window.check((101, 73))

    def test_reload(self):
        window = Window(self)
        window.check()
        red = SCENE.replace("0.9, 0.8, 0.7", "1, 0, 0")
        for name, replace in ("written", write), ("renamed", self.write_by_rename):
            with self.subTest(name):
                text = red if name == "written" else red.replace("[1, 0, 0]", "[0, 1, 0]")
                replace("scene.yaml", text)
                window.shows_at_last(self.image_of(text))
        write("scene.yaml", red.replace("material", "metarial"))
        window.line("^scene.yaml:5:.*metarial")
        self.assertIn("metarial: {", window.line("(.*)$")[1])
        self.assertRegex(window.line("(.*)$")[1], r"^ *\^")
        moved = red.replace("-4]", "-5]")
        write("scene.yaml", moved)  # the message is gone, and the camera is the file's
        window.shows_at_last(self.image_of(moved))
        self.assertEqual(numbers(window.camera(), "position"), [0.5, 1, -5])

    def test_reload_of_a_mesh(self):
        """When a mesh changes, the view keeps its moved camera."""
        window = Window(self)
        window.saved()
        window.key("Left")
        camera = window.camera()
        window.key("x")  # hides it
        write("mesh.obj", MESH.replace("1 1 0", "1.5 1 0"))
        window.shows_at_last(self.image_of(re.sub("^camera: .*", camera, SCENE)))

    def test_reload_keeps_what_is_set(self):
        window = Window(self, options="--set background=red")
        window.shows_at_last(self.image_of(SCENE.replace("[0.125, 0.25, 0.5]", "[1, 0, 0]")))
        changed = SCENE.replace("[0.9, 0.8, 0.7]", "[0.1, 0.8, 0.7]")
        write("scene.yaml", changed)
        window.shows_at_last(self.image_of(changed.replace("[0.125, 0.25, 0.5]", "[1, 0, 0]")))

    def test_reload_of_an_image(self):
        """If an image becomes unreadable, the last scene stays and can be moved and saved."""
        text = SCENE + "  - plane: {point: [0, -1, 0], normal: [0, 1, 0], material: {image: image.png}}\n"
        shutil.copy(ROOT / "scenes/images/globe.png", "image.png")
        write("scene.yaml", text)
        shutil.copytree(".", "before")
        window = Window(self)
        window.saved()
        write("image.png", "no image")
        window.line("^scene.yaml:6:.*image.png")
        window.key("Left")
        write("before/scene.yaml", re.sub("^camera: .*", window.camera(), text))
        self.glint(f"render before/scene.yaml --size {WIDTH}x{HEIGHT} --samples {SAMPLES} -o before.png")
        self.assertSameBytes(window.saved(), "before.png")
        window.key("x")
        shutil.copy("before/image.png", "image.png")
        window.shows_at_last(png_rows("before.png"))

    def test_reload_of_what_cannot_be_rendered(self):
        """The last scene stays, which can be saved and moved."""
        window = Window(self)
        window.check()
        write("scene.yaml", SCENE.replace("[3, 4, -5]", "[1e25, 4, -5]"))
        window.line("a light is 1e.25 from the eye")
        window.check()
        window.key("Left")
        window.check()

    def test_reload_of_an_included_file(self):
        """The included camera cannot be written into the scene's file."""
        camera, background, *others = SCENE.splitlines(keepends=True)
        write("stage.yaml", camera + background)
        write("scene.yaml", "include: stage.yaml\n" + "".join(others))
        window = Window(self, options="--write-camera")
        window.shows_at_last(self.image_of(SCENE))
        window.key("Left")
        window.camera()
        window.line("^scene.yaml:1:10: error: the camera cannot be written: it is in an included file")
        window.key("r", "x")
        changed = background.replace("0.125", "0.75")
        write("stage.yaml", camera + changed)
        window.shows_at_last(self.image_of(SCENE.replace(background, changed)))

    def test_reload_of_a_linked_file(self):
        """A file is watched where symbolic links lead, and the camera is written there."""
        for folder, name in ("scenes", "scene.yaml"), ("meshes", "mesh.obj"):
            os.mkdir(folder)
            shutil.move(name, folder)
            os.symlink(f"{folder}/{name}", name)
        os.symlink("../mesh.obj", "scenes/mesh.obj")
        window = Window(self, options="--write-camera")
        window.shows_at_last(self.image_of(SCENE))
        changed = SCENE.replace("0.9, 0.8, 0.7", "1, 0, 0")
        write("scenes/scene.yaml", changed)
        window.shows_at_last(self.image_of(changed))
        write("meshes/mesh.obj", MESH.replace("1 1 0", "1.5 1 0"))
        window.shows_at_last(self.image_of(changed))
        window.key("Left")
        camera = window.camera()
        window.line("^camera written to scene.yaml")
        self.assertEqual(numbers(read("scenes/scene.yaml"), "position"), numbers(camera, "position"))
        self.assertTrue(Path("scene.yaml").is_symlink())
        window.close()

    def test_mesh_of_a_mistaken_scene(self):
        """A mesh that only the mistaken scene names is watched."""
        window = Window(self)
        window.saved()
        text = SCENE.replace("mesh.obj", "other.obj")
        write("scene.yaml", text)
        window.line("^scene.yaml:5:.*other.obj.*No such file")
        write("other.obj", MESH.replace("1 1 0", "1.5 1 0"))
        window.shows_at_last(self.image_of(text))

    def test_written_camera(self):
        """The camera is written into the file, whose other bytes stay. The file is not re-read for it."""
        comment = "# kept\n"
        write("scene.yaml", comment + SCENE)
        window = Window(self, options="--write-camera")
        window.saved()
        window.key("Left")
        camera = window.camera()
        window.line("^camera written to scene.yaml")
        text = Path("scene.yaml").read_text()
        self.assertEqual(text.replace(text.splitlines()[1], SCENE.splitlines()[0]), comment + SCENE)
        self.assertEqual(numbers(text, "position"), numbers(camera, "position"))
        window.key("Left", "Left")
        moved = window.camera()
        self.assertNotEqual(moved, camera)
        window.line("^camera written")
        window.key("Right", "r")  # to what was written last
        self.assertEqual(window.camera(), moved)
        window.line("^camera written")
        write("scene.yaml", SCENE)  # what others write is read
        window.key("x")
        window.shows_at_last(self.image_of(SCENE))
        write("scene.cfg", "")
        self.refuses("view scene.cfg --write-camera", "not in YAML")

    def test_standard_input(self):
        """A file that is named like standard input is not read instead of it."""
        write("-", "not a scene")
        with open("scene.yaml", encoding="utf-8") as scene:
            window = Window(self, "-", stdin=scene)
        window.shows_at_last(self.image_of(SCENE))
        self.assertEqual(window.saved(), "image-1.png")

    def test_changes_during_a_write(self):
        """Changes that others write just before or while the camera is written are read."""
        window = Window(self, options="--write-camera", LD_PRELOAD=self.failing_calls())
        window.saved()
        for path, old, new in ("mesh.obj", "1 1 0", "1.5 1 0"), ("scene.yaml", "0.9, 0.8, 0.7", "1, 0, 0"):
            with self.subTest(path):
                write("late", "")
                write(path, read(path).replace(old, new))
                window.key("Left", "c")
                window.line("^camera written to scene.yaml")
                window.key("x")  # hides it
                os.remove("late")
                window.shows_at_last(self.image_of(read("scene.yaml")))

    def test_camera_of_another_file(self):
        """The camera's file is watched, and the camera is written into it."""
        camera, *others = SCENE.splitlines(keepends=True)
        write("scene.yaml", "".join(others))
        write("shot.yaml", camera)
        window = Window(self, options="--camera shot.yaml --write-camera")
        window.shows_at_last(self.image_of(SCENE))
        window.key("Left")
        camera = window.camera()
        window.line("^camera written to shot.yaml")
        window.key("x")  # hides it
        self.assertEqual(numbers(Path("shot.yaml").read_text(), "position"), numbers(camera, "position"))
        moved = SCENE.replace("-4]", "-5]")
        write("shot.yaml", moved)
        window.shows_at_last(self.image_of(moved))

    @staticmethod
    def failing_calls():
        return shim_build("view.so", read(ROOT / "tests/shims/view.c"), "-ldl")

    def test_unwatched_files(self):
        """If the system can watch no more files, a warning states that changes will not be noticed."""
        write("unwatched", "")
        window = Window(self, LD_PRELOAD=self.failing_calls())
        window.line("^glint: warning: changes to files will not be noticed: Too many open files")
        window.check()

    def test_unwatched_folders(self):
        """Folders that cannot be watched are reported once, however many files they hold."""
        write("folders", "")
        window = Window(self, LD_PRELOAD=self.failing_calls())
        warning = "^glint: warning: changes to .* will not be noticed: No space left"
        window.line(warning)
        window.saved()
        window.close()
        window.reader.join()
        self.assertEqual([line for line in iter(window.lines.get_nowait, "") if re.match(warning, line)], [])

    def test_failing_device(self):
        """A failing device's message is shown, and the window stays. The next movement retries."""
        window = Window(self, **faults("clEnqueueNDRangeKernel file=fails:0 fail"))
        window.saved()
        write("fails", "")
        for key in "Left", "Up", "r", "r":
            window.key(key)
            window.line("^clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES")
        os.remove("fails")
        write("scene.yaml", SCENE + "  - sphere: {center: [0, 0, 9], radius: 1, material: {image: none.png}}\n")
        window.line("^scene.yaml:6:.*none.png")
        window.check()  # the last scene stays
        window.key("Right")
        window.check()

    def test_slow_scene(self):
        """The window is shown and can be closed while the scene is read, here from a pipe. What is saved meanwhile is noticed."""
        later = SCENE.replace("0.9, 0.8, 0.7", "1, 0, 0")
        for closes in False, True:
            with self.subTest(closes=closes):
                Path("slow.yaml").unlink(missing_ok=True)
                os.mkfifo("slow.yaml")
                window = Window(self, "slow.yaml", waits=False)
                window.title_at_last("preparing")
                window.message_at_last()  # what is read
                if closes:
                    window.key("Escape")
                    wait_until(lambda: not windows_shown(window.process.pid), "the window is still shown")
                with open("slow.yaml", "w") as pipe:
                    self.write_by_rename("slow.yaml", later)  # while the pipe is read
                    pipe.write(SCENE)
                if closes:
                    self.assertEqual(window.process.wait(DEADLINE), 0)
                else:
                    window.shows_at_last(self.image_of(later))
                    window.close()

    @staticmethod
    def write_by_rename(path, text):
        os.rename(write("other", text), path)

    def image_of(self, text, options=""):
        write("expected.yaml", text)
        self.glint(f"render expected.yaml --size {WIDTH}x{HEIGHT} --samples {SAMPLES} {options} -o expected.png")
        return png_rows("expected.png")

    def test_views_and_precisions(self):
        """Views have titles. Those but the color are black at the corner, which sees the background, and not at the center."""
        window, black = Window(self), (0, 0, 0)
        for view in "color", "depth", "normal", "object", "shadow", "error against double":
            with self.subTest(view):
                window.title_at_last(f", {view}, single, ")
                if view != "color":
                    wait_until(lambda: window.pixel(0, 0) == black and (window.pixel(80, 60) != black or "error" in view),
                               "the corner is not black, or the center is")
                window.key("v")
        for key, precision in ("2", "strict"), ("3", "double"), ("4", "certified"), ("1", "single"):
            with self.subTest(precision):
                window.key(key)
                window.title_at_last(f", color, {precision}, ")
                window.shows_at_last(self.image_of(SCENE, f"--precision {precision}"))

    def test_legend(self):
        """The scale of the errors is a bar of many colors in the lower right corner."""
        window = Window(self)
        xdotool("windowsize", "--sync", window.id, 320, 360)
        window.key("shift+v")
        window.title_at_last(", error against double, ")
        wait_until(lambda: window.most_colors_of_a_column(range(160, 320), range(180, 360)) >= 64, "there is no legend")

    def shows_frame(self, window, text, frame):
        """Checks that the display, except for the time line's mark, and the saved image are what glint render makes of the frame."""
        window.title_at_last(f", frame {frame} of 0-{FRAMES - 1}, {SAMPLES} samples")
        rows = self.image_of(text, f"--frames {frame}")
        window.shows_at_last(rows[: HEIGHT * 2 // 3])
        mark = int((frame + 0.5) / FRAMES * WIDTH), HEIGHT - 1
        wait_until(lambda: window.pixel(*mark) == (96, 160, 255), "the time line does not show the frame")
        self.assertEqual(png_rows(window.saved()), rows)
        window.key("x")  # hides the message

    def test_frames(self):
        """Keys and the mouse choose a frame. A camera that was moved stays."""
        write("scene.yaml", ANIMATION)
        window = Window(self)
        self.shows_frame(window, ANIMATION, 0)
        window.key("period")
        self.shows_frame(window, ANIMATION, 1)
        window.key("comma", "comma")
        self.shows_frame(window, ANIMATION, 7)
        low = HEIGHT - 5
        window.mouse(WIDTH * 11 // 16, low, "click", 1)
        self.shows_frame(window, ANIMATION, 5)
        window.drag(1, (WIDTH * 11 // 16, low), (WIDTH * 3 // 16, low), (WIDTH * 5 // 16, 0))
        self.shows_frame(window, ANIMATION, 2)
        window.key("Left")
        moved = re.sub("(?m)^camera: .*", window.camera(), ANIMATION)
        window.key("x", "period")
        self.shows_frame(window, moved, 3)
        window.key("r")
        self.shows_frame(window, ANIMATION, 3)
        brighter = ANIMATION.replace("[0.1, 0.5, 0.9]", "[1, 1, 1]")
        write("scene.yaml", brighter)  # read at this frame
        self.shows_frame(window, brighter, 3)
        write("scene.yaml", SCENE)  # the time line is gone
        window.key("x")
        window.shows_at_last(self.image_of(SCENE))
        self.assertNotIn("frame", xdotool("getwindowname", window.id))
        window.key("space", "period")
        window.check()

    def stays(self, window):
        """Checks that an animation has paused, and returns its frame."""
        window.camera()  # once it has seen all that came before
        window.key("x")
        frame = window.frame()
        self.image_of(ANIMATION)  # meanwhile it would play
        self.assertEqual(window.frame(), frame)
        return frame

    def test_play(self):
        """An animation plays past the last frame, and stays when paused."""
        write("scene.yaml", ANIMATION)
        window = Window(self)
        window.key("comma", "space")
        seen = set()
        wait_until(lambda: seen.add(window.frame()) or len(seen) == 4, "it does not play")
        window.key("space")
        self.shows_frame(window, ANIMATION, frame := self.stays(window))
        window.key("space")
        wait_until(lambda: window.frame() != frame, "it does not play")
        write("scene.yaml", ANIMATION.replace("material", "metarial"))  # what cannot be read stops it
        window.line("^scene.yaml:6:.*metarial")
        self.stays(window)

    def test_recorded_keys(self):
        """K adds a key to the file, whose other keys and text stay. The view follows them."""
        write("scene.yaml", ANIMATION + "# kept\n")
        window = Window(self)
        window.key("k")  # needs --write-camera
        window.message_at_last()
        window.close()
        window = Window(self, options="--write-camera")
        window.key("period", "period")
        window.title_at_last(f", frame 2 of 0-{FRAMES - 1}, {SAMPLES} samples")
        window.key("Left")
        camera = window.camera()
        window.line("^scene.yaml:2:20: error: the camera cannot be written: it is animated; K records a key")
        window.key("k")
        window.line("^camera written to scene.yaml at frame 2")
        text = Path("scene.yaml").read_text()
        position = re.search(r"position: (\[.*?\])", camera)[1]
        self.assertEqual(
            text, ANIMATION.replace("-4], 7", f"-4], 2: {position}, 7").replace(": [0, 0, 0], fov", ": {keys: {2: [0, 0, 0]}}, fov")
            + "# kept\n")
        window.key("x", "period", "period")
        self.shows_frame(window, text, 4)
        window.key("--delay", 0, "period", "k")  # what the view will have at that frame
        window.line("^camera written to scene.yaml at frame 5")
        keyed = Path("scene.yaml").read_text()
        self.assertEqual(self.image_of(keyed, "--frames 5"), self.image_of(text, "--frames 5"))
        self.assertEqual(keyed.count("5: ["), 2)

    def test_help(self):
        window = Window(self)
        window.check()
        before = screen()
        window.key("h")
        window.changes_at_last(before)
        window.key("h")
        window.check()

    def test_facts(self):
        """A pixel's object, line, material, t and normal, and the tree of its rays, follow the camera."""
        write("scene.yaml", SCENE + """\
  - sphere:
      {center: [0.25, 0.5, -2], radius: 0.5, material: {reflection: 0.5, transmission: 0.25}}
  - plane: {point: [0, -9, 0], normal: [0, 1, 0]}
""")
        window = Window(self)
        window.title_at_last(" samples")
        window.mouse(80, 60)
        before = screen()
        window.key("i")
        window.line(r"^pixel 80,60: sphere 3, scene.yaml:6, t ")
        groups = window.line(r"^  at ([-.\d]+) ([-.\d]+) ([-.\d]+), normal ([-.\d]+) ([-.\d]+) ([-.\d]+)$").groups()
        point, normal = [float(number) for number in groups[:3]], [float(number) for number in groups[3:]]
        self.glint(f"render scene.yaml --size {WIDTH}x{HEIGHT} --aov position -o image.npy")
        for printed, position in zip(point, npy_read("image.position.npy")[2][60 * WIDTH + 80], strict=True):
            self.assertAlmostEqual(printed, position, 5)
        for axis, center in enumerate((0.25, 0.5, -2)):  # of radius 0.5
            self.assertAlmostEqual((point[axis] - center) / 0.5, normal[axis], 3)
        window.line(r"^  reflected, 0.5: nothing$")
        window.line(r"^  refracted, 0.25: sphere 3, scene.yaml:6, t ")
        window.line(r"^    reflected, 0.125: sphere 3")
        window.changes_at_last(before)
        window.key("i")
        window.mouse(80, 119)
        window.key("i")
        window.line(r"^pixel 80,119: plane 4, scene.yaml:8, t ")
        window.key("i")

    def test_interrupt(self):
        window = Window(self, status=130)
        window.process.send_signal(signal.SIGINT)
        self.assertEqual(window.process.wait(DEADLINE), 130)

    def test_faults(self):
        environment = {"DISPLAY": "", "WAYLAND_DISPLAY": ""}
        self.refuses("view scene.yaml", "no display", env=environment)
        self.refuses("view", "no scene")
        write("bad.yaml", "camera: 5\n")
        self.refuses("view bad.yaml", "^bad.yaml:1:9: error")

    def test_random_events(self):
        """Nothing that a user does ends the program, and afterwards the image is right."""
        draw = random.Random(19)
        keys = ["r", "c", "h", "w", "a", "d", "e", "Left", "Up", "shift", "space", "comma", "period", "k"]
        keys += ["v", "1", "2", "t", "i", "f"] if IS_LONG else []  # many kernels
        write("scene.yaml", ANIMATION)
        window = Window(self, options="--write-camera")
        for _ in range(10000 // 50 if IS_LONG else 6):
            words = []
            for _ in range(50):
                x, y = draw.randrange(WIDTH), draw.randrange(HEIGHT)
                button, key = draw.randint(1, 5), draw.choice(keys)
                words += draw.choice([
                    ["mousemove", "--window", window.id, x, y],
                    ["mousedown", button], ["mouseup", button],
                    ["keydown", key], ["keyup", key],
                    ["click", button],
                    ["windowsize", window.id, draw.randint(1, WIDTH), draw.randint(1, HEIGHT)],
                ])
            xdotool(*words)
        xdotool(*[word for button in range(1, 6) for word in ("mouseup", button)])
        xdotool(*[word for key in keys for word in ("keyup", key)])
        while ", color, " not in xdotool("getwindowname", window.id):
            window.key("v")
        xdotool("windowsize", window.id, WIDTH, HEIGHT)
        window.title_at_last(f"{WIDTH}x{HEIGHT}")
        window.key("comma")  # pauses
        path = window.saved()
        self.assertEqual(png_read(path)[0][:2], (WIDTH, HEIGHT))
        window.close()
        self.glint("check scene.yaml")  # whose camera has many keys


def window_camera_in_flight(window):
    """Releases the right button, while which is held keys fly, and presses it again after the camera is printed."""
    xdotool("mouseup", 3)
    camera = window.camera()
    xdotool("mousedown", 3)
    return camera


if __name__ == "__main__":
    for tool in "Xvfb", "xdotool":
        if not shutil.which(tool):
            skip_all(f"there is no {tool}")
    need_device()
    if "built without a window" in run("view scenes/demo.yaml", env={"DISPLAY": ""}).stderr:
        skip_all("glint is built without a window")
    with display_open():
        main()
