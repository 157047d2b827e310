#!/usr/bin/env -S python3 -B
"""Tests what the Python package over libglint raises and warns of, and how it closes what it opened.

run_tests: sanitize-long-only"""
import contextlib
import copy
import ctypes
import json
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import unittest
import warnings
from pathlib import Path
from unittest import mock

from python_package import CUBE_FACES, CUBE_VERTICES, ROOT, SPHERE, glint, np


class Errors(unittest.TestCase):
    def test_messages(self):
        for make, words in (
                (lambda: glint.Scene({"objects": []}), "lacks 'camera'"), (lambda: glint.Scene("objects: ["), "scene.yaml:1"),
                (lambda: glint.load("missing.yaml"), "missing.yaml.*No such file"),
                (lambda: glint.load_mesh(CUBE_VERTICES, CUBE_FACES + 1), "no vertex 8 of 8"),
                (lambda: glint.load_mesh(CUBE_VERTICES * np.nan, CUBE_FACES), r"vertex 0 is \(-?nan, -?nan, -?nan\)"),
                (lambda: glint.load_mesh(CUBE_VERTICES, CUBE_FACES, CUBE_VERTICES * np.nan), r"normal 0 is \(-?nan, "),
                (lambda: glint.load_mesh(CUBE_VERTICES, CUBE_FACES[:0]), "1 to"),
                (lambda: glint.load_mesh(CUBE_VERTICES, -CUBE_FACES), "no vertex -7"),
                (lambda: glint.load_mesh(CUBE_VERTICES, [[1 << 32, (1 << 32) + 1, 2]]), "no vertex 4294967297"),
                (lambda: glint.Scene(SPHERE).render(640), "both width and height"),
                (lambda: glint.Scene(SPHERE).render(8, 6, device="toaster"), "toaster"),
                (lambda: glint.Scene(SPHERE).render(8, 6, lanes=3), "lanes"),
                (lambda: glint.Scene(SPHERE).render(1 << 21, 6), "pixels per side"),
                (lambda: glint.Scene(SPHERE).trace([[0, 0, 0]], [[0, 0, 0]]), "ray 0: a ray.s direction cannot be 0 0 0"),
                (lambda: glint.Scene(SPHERE).trace([[0, np.inf, 0]], [[0, 0, 1]]), "ray 0: the origin is not finite"),
                (lambda: glint.Scene(SPHERE).trace([[0, 1e39, 0]], [[0, 0, 1]]), "the origin is beyond the range of float; use precision double"),
                (lambda: glint.Scene(SPHERE).trace([[0, 0, 0]], [[0, 0, np.nan]]), "the direction is not finite"),
                (lambda: glint.Scene(SPHERE).trace([[0, 0, 0]], [[0, 0, 1]], tmin=np.inf), "tmin is not finite"),
                (lambda: glint.Scene(SPHERE).trace([[0, 0, 0]], [[0, 0, 1]], tmax=np.nan), "tmax is not a number"),
                (lambda: glint.Scene(SPHERE).trace([[0, 0, 0]], [[0, 0, 1]], precision="certified", tmin=1), "tmin must be 0")):
            with self.assertRaisesRegex(glint.SceneError, words):
                make()
        for make in (lambda: glint.Scene(SPHERE).trace([0, 0, 0], [0, 0, 1]), lambda: glint.load_mesh(CUBE_VERTICES, [[0.5] * 3]),
                     lambda: glint.Scene(SPHERE).render(8, 6, precision="fast"), lambda: glint.Scene(SPHERE).render_layers(["depth"])):
            with self.assertRaises(ValueError):
                make()
        for make in (lambda: glint.Scene(SPHERE).render(8, 6, 2), lambda: glint.Scene(SPHERE).render_layers(["t"], 8, 6, 2),
                     lambda: glint.Scene(SPHERE).trace([[0, 0, 0]], [[0, 0, 1]], "double"), lambda: glint.load("scene.yaml", {})):
            with self.assertRaisesRegex(TypeError, "positional"):
                make()

    def test_callbacks_and_lifetimes(self):
        """An exception from progress reaches the caller, even if progress frees or uses a scene of the device. Handles are not shared."""
        scene, other = glint.Scene(SPHERE), glint.load_mesh(CUBE_VERTICES, CUBE_FACES)
        other.trace([[3, 3, 3]], [[1, 0, 0]])

        def progress(fraction):
            nonlocal other
            other.trace([[3, 3, 3]], [[1, 0, 0]])
            other = None
            raise KeyError("mine")
        with self.assertRaisesRegex(KeyError, "mine"):
            scene.render(640, 360, progress=progress)

        def fail(_function, _device, _scene, settings, _image):
            settings._obj.progress(None, 0.5)
            raise glint.DeviceError("lost")
        with mock.patch.object(glint._h, "call", fail):
            with self.assertRaisesRegex(KeyError, "mine"):
                scene.render(640, 360, progress=mock.Mock(side_effect=KeyError("mine")))
        for wrong in copy.copy, pickle.dumps:
            with self.assertRaisesRegex(TypeError, "copied or pickled"):
                wrong(scene)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaises(glint.GlintWarning):
                glint.Scene({**SPHERE, "lights": []})
        for wrong in ({"samples": (1 << 32) + 1}, {"lanes": (1 << 32) + 4}):
            with self.assertRaisesRegex(ValueError, "expected 0 to 4294967295"):
                scene.render(8, 6, **wrong)
        with self.assertRaisesRegex(ValueError, "samples: expected 1 to 1048576, not 0"):
            scene.render(8, 6, samples=0)

    def test_warnings(self):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            glint.Scene({**SPHERE, "lights": []})
            glint.Scene("camera: {position: [0, 0, 1], look_at: [0, 0, 0],\n focus: 2}\nlights: [directional: {direction: [0, 0, 1]}]\n"
                        "objects: [sphere: {center: [0, 0, 0], radius: 1}]", name="lens.yaml")
        self.assertEqual([(w.category, w.filename) for w in caught], [(glint.GlintWarning, __file__)] * 2)
        self.assertIn("no lights", str(caught[0].message))
        self.assertEqual(str(caught[1].message).splitlines()[0], "lens.yaml:2:9: warning: 'focus' has no effect without an 'aperture'")

    def test_warnings_of_opening(self):
        """A warning of a device that is opened points to the user's line, not into contextlib."""
        def device_open(_selector, _device, messages):
            messages._obj.value = copy_text(b"slow")
            return 0
        copy_text = ctypes.CDLL(None).strdup
        copy_text.restype = ctypes.c_void_p
        with mock.patch.object(glint._c.library, "glint_device_open", device_open), mock.patch.dict(glint._h._opened), \
                warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            with glint._h.device_opened("warns"):
                pass
        self.assertEqual([(str(w.message), w.filename) for w in caught], [("slow", __file__)])

    def test_warnings_of_devices(self):
        """A device warns once about a kernel cache that others can access, and prints nothing."""
        program = f"""if True:
            import warnings, glint
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                for _ in range(2):
                    glint.Scene({SPHERE!r}).render(8, 6)
            for warning in caught:
                print(warning.category.__name__, warning.filename, warning.message)"""
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "glint").mkdir(mode=0o700)
            Path(folder, "glint").chmod(0o770)
            process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False,
                                     env={**os.environ, "XDG_CACHE_HOME": folder, "PYTHONPATH": str(ROOT / "host/python")})
            self.assertEqual((process.stdout, process.stderr), (
                f"GlintWarning <string> glint: warning: the kernel cache '{folder}/glint' is not used: others may access it\n", ""))

    @unittest.skipUnless(shutil.which("localedef") and os.path.exists("/usr/share/i18n/locales/de_DE"), "localedef makes no de_DE")
    def test_locale(self):
        """In a locale with decimal commas a scene, interpolated between two keys, and messages are the same."""
        program = f"""if True:
            import glint, locale, pathlib, sys, warnings
            locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
            scene = glint.Scene({{**{SPHERE!r}, "frames": 3, "objects": [{{"sphere": {{"center": [0, 0, 0], "radius": {{"keys": {{"0": 1, "2": 2}}}}}}}}]}}, frame=0.5)
            print(scene.trace([[0, 0, -4]], [[0, 0, 1]], precision="double").t.tolist(), locale.str(0.5))
            folder = pathlib.Path(sys.argv[1])
            (folder / "mesh.obj").write_text("mtllib mesh.mtl\\nv 0 0 0\\nv 1 0 0\\nv 0 1 0\\nusemtl a\\nf 1 2 3\\n")
            (folder / "mesh.mtl").write_text("newmtl a\\nd 0.25\\nTr 0.5\\n")
            with warnings.catch_warnings(record=True) as caught:
                glint.load(folder / "mesh.obj")
            print(*("Tr 0.5 contradicts d 0.25" in str(warning.message) for warning in caught))"""
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["localedef", "-f", "UTF-8", "-i", "de_DE", f"{folder}/de_DE.UTF-8"], check=True, stdout=subprocess.DEVNULL)
            process = subprocess.run([sys.executable, "-c", program, folder], capture_output=True, text=True, check=False,
                                     env={**os.environ, "LOCPATH": folder, "PYTHONPATH": str(ROOT / "host/python")})
        self.assertEqual((process.stdout, process.stderr), ("[2.75] 0,5\nTrue\n", ""))

    def test_max_pixels(self):
        """max_pixels limits the pixels of an image in the scene."""
        with tempfile.TemporaryDirectory() as folder:
            image, path = Path(folder, "image.ppm"), Path(folder, "scene.yaml")
            image.write_bytes(b"P6 3 2 255 " + bytes(18))
            path.write_text(json.dumps({**SPHERE, "objects": [{"sphere": {"center": [0, 0, 0], "radius": 1, "material": {"image": "image.ppm"}}}]}))
            for make in lambda most: glint.load(path, max_pixels=most), lambda most: glint.Scene(path.read_text(), name=str(path), max_pixels=most):
                self.assertEqual([make(most).object_count for most in (0, 6)], [1, 1])
                with self.assertRaisesRegex(glint.SceneError, rf"scene.yaml:1:\d+: error: cannot read '{image}': the image has 3 x 2 pixels; max-pixels allows 5"):
                    make(5)

    def test_later_structs(self):
        """A caller of a later version may set only what this one knows."""
        library = glint._c.library

        class Later(glint._c.TraceSettings):
            _fields_ = [("later", ctypes.c_uint64)]
        scene = glint.Scene(SPHERE)
        for value, status in (0, 0), (1, 1):
            tracer, messages = ctypes.c_void_p(), ctypes.c_void_p()
            settings = Later(ctypes.sizeof(Later), 0, 0, value)
            with glint._h.device_opened(None) as device:
                self.assertEqual(library.glint_tracer_open(device, scene._handle, ctypes.cast(ctypes.byref(settings), ctypes.POINTER(glint._c.TraceSettings)),
                                                           ctypes.byref(tracer), ctypes.byref(messages)), status)
            self.assertEqual(bool(messages), status == 1)
            if messages:
                self.assertIn(b"a GlintTraceSettings sets a member that glint", ctypes.string_at(messages))
            library.glint_text_free(messages)
            library.glint_tracer_close(tracer)

    def test_failed_device(self):
        """A failed device is closed after its tracers and re-opened by its next use."""
        library, closed = glint._c.library, []
        index = next(device.index for device in glint.devices() if device.is_usable)
        with contextlib.ExitStack() as stack:
            for name in "glint_tracer_close", "glint_device_close":
                close = getattr(library, name)
                stack.enter_context(mock.patch.object(library, name, lambda handle, name=name, close=close: (closed.append(name), close(handle))))
            scene, other = glint.Scene(SPHERE), glint.Scene(SPHERE)
            for user, precision in (scene, "single"), (other, "double"):
                user.trace([[0, 0, -4]], [[0, 0, 1]], device=index, precision=precision)
            with mock.patch.object(library, "glint_trace", lambda *_: 2), self.assertRaises(glint.DeviceError):
                scene.trace([[0, 0, -4]], [[0, 0, 1]], device=index)
            self.assertEqual(closed, ["glint_tracer_close", "glint_tracer_close", "glint_device_close"])
            self.assertEqual(scene.trace([[0, 0, -4]], [[0, 0, 1]], device=index).object.tolist(), [0])

    def test_warning_as_error(self):
        """A warning that is an error does not lose the arrays of all hits."""
        library, freed = glint._c.library, []
        trace, free = library.glint_trace_all, library.glint_all_hits_free

        def trace_all(*arguments):
            status = trace(*arguments)
            arguments[-1]._obj.value = copy_text(b"slow")
            return status
        copy_text = ctypes.CDLL(None).strdup
        copy_text.restype = ctypes.c_void_p
        with mock.patch.object(library, "glint_trace_all", trace_all), warnings.catch_warnings(), \
                mock.patch.object(library, "glint_all_hits_free", lambda hits: (freed.append(bool(hits._obj.ray)), free(hits))):
            warnings.simplefilter("error")
            with self.assertRaisesRegex(glint.GlintWarning, "slow"):
                glint.Scene(SPHERE).trace_all([[0, 0, -4]], [[0, 0, 1]])
        self.assertEqual(freed, [True])

    def test_pocl_of_pip(self):
        """PoCL's wheel is found where the system has no driver."""
        with tempfile.TemporaryDirectory() as folder:
            for name in "pocl_binary_distribution/__init__.py", "pyopencl/.libs/libpocl-12ab.so", "vendors/some.icd":
                Path(folder, name).parent.mkdir(parents=True)
                Path(folder, name).touch()
            sys.path.insert(0, folder)
            try:
                self.assertEqual(glint._c.pocl_of_pip("/nowhere"), f"{folder}/pyopencl/.libs/libpocl-12ab.so")
                self.assertIsNone(glint._c.pocl_of_pip(f"{folder}/vendors"))
            finally:
                sys.path.remove(folder)

    def test_devices(self):
        devices = glint.devices()
        self.assertTrue(devices and all(device.index == i and device.name for i, device in enumerate(devices)))
        self.assertRegex(glint.version(), r"^\d+\.\d+\.\d+")

        def list_many(infos, capacity, count, _messages):
            count._obj.value = 300
            for i in range(min(capacity, 300)):
                infos[i].index = i
            return 0
        with mock.patch.object(glint._c.library, "glint_devices_list", list_many):
            self.assertEqual([device.index for device in glint.devices()], list(range(300)))


if __name__ == "__main__":
    unittest.main()
