#!/usr/bin/env -S python3 -B
"""Tests the Python package over libglint: scenes, images and their metrics, rays with bounds, the drop-in for trimesh and threads.

run_tests: sanitize-long-only"""
import ctypes
import dataclasses
import json
import os
import subprocess
import tempfile
import threading
import unittest
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path
from unittest import mock

from python_package import BUILD, CUBE_FACES, CUBE_VERTICES, IS_LONG, ROOT, SPHERE, glint, np, sphere


class Mesh:
    """The part of a trimesh.Trimesh that RayMeshIntersector uses."""
    vertices, faces = CUBE_VERTICES, CUBE_FACES


class Images(unittest.TestCase):
    def test_layers(self):
        layers = glint.Scene(SPHERE).render_layers(tuple(glint.LAYERS), 40, 30, precision="certified")
        self.assertEqual({name: array.shape for name, array in layers.items()},
                         {"color": (30, 40, 3), "t": (30, 40), "normal": (30, 40, 3), "position": (30, 40, 3), "object": (30, 40),
                          "shadow": (30, 40, 1), "flag": (30, 40), "coverage": (30, 40), "backdrop": (30, 40, 3)})
        hit = layers["object"] == 0
        self.assertTrue(np.all(layers["coverage"] == hit))
        np.testing.assert_allclose(layers["backdrop"], ~hit[..., None] * np.array(SPHERE["background"]), atol=1e-7)
        self.assertTrue(0.05 < hit.mean() < 0.3 and np.all(layers["object"][~hit] == glint.MISS))
        self.assertTrue(np.all(np.isinf(layers["t"][~hit])) and np.allclose(layers["color"][~hit], [0.1, 0.2, 0.4]))
        # a hit point lies on the sphere, in the direction of its normal, at its distance from the camera
        position = layers["position"][hit]
        np.testing.assert_allclose(np.linalg.norm(position, axis=1), 1, atol=1e-6)
        np.testing.assert_allclose(position, layers["normal"][hit], atol=1e-5)
        np.testing.assert_allclose(np.linalg.norm(position - [0, 0, -4], axis=1), layers["t"][hit], atol=1e-5)

    def test_equals_the_program(self):
        """The image has the bits of glint render's, in long tests that of the documents' example."""
        path = ROOT / ("scenes/article.yaml" if IS_LONG else "tests/scenes/mirror-balls.yaml")
        scene = glint.load(path)
        image = scene.render(64, 36, samples=2, bounces=3, precision="strict")
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([BUILD / "glint", "render", path, "--size", "64x36", "--samples", "2", "--bounces", "3",
                            "--precision", "strict", "-o", f"{folder}/image.npy", "--quiet"], check=True)
            np.testing.assert_array_equal(image, np.load(f"{folder}/image.npy"))

    def test_wrong_values(self):
        """Values that are of the wrong type raise ValueError, and paths are texts."""
        with self.assertRaisesRegex(glint.SceneError, "no-such-file.hdr"):
            glint.Scene({"background": {"image": Path("no-such-file.hdr")}})
        for wrong in {1, 2}, b"bytes", {(1, 2): 3}:
            with self.assertRaises(ValueError):
                glint.Scene({"background": wrong})
        scene = glint.Scene(SPHERE)
        with self.assertRaisesRegex(ValueError, "width: expected an integer, not 8.0"):
            scene.render(8.0, 8)

    def test_overrides_and_frames(self):
        """Replaced values and a frame's values have the same effect as if the scene contained them."""
        def image(scene):
            return scene.render(32, 18, precision="strict")
        moving = {**SPHERE, "objects": [sphere({"keys": {0: 1, 4: 2}})]}
        small, large = (image(glint.Scene({**SPHERE, "objects": [sphere(radius)]})) for radius in (1, 1.5))
        self.assertFalse(np.array_equal(small, large))
        np.testing.assert_array_equal(image(glint.Scene(moving)), small)
        np.testing.assert_array_equal(image(glint.Scene(moving, frame=2)), large)
        np.testing.assert_array_equal(image(glint.Scene(moving, frame=2, overrides={"objects[0].sphere.radius": 1})), small)
        np.testing.assert_array_equal(image(glint.Scene(SPHERE, overrides={"objects[0]": sphere(np.float64(1.5))})), large)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "scene.json")
            path.write_text(json.dumps(moving))
            np.testing.assert_array_equal(image(glint.load(path, frame=2)), large)
            np.testing.assert_array_equal(image(glint.load(path, overrides={"objects[0].sphere.radius": 1.5})), large)
            shot = Path(folder, "shot.json")
            shot.write_text(json.dumps({"camera": {**SPHERE["camera"], "fov": 20}, "frames": 3}))
            np.testing.assert_array_equal(image(glint.load(path, camera=shot)), image(glint.Scene(SPHERE, overrides={"camera.fov": 20})))
            self.assertEqual([glint.load(path).frame_count, glint.load(path, camera=shot).frame_count], [0, 3])
        for overrides, reason in ({"camera.zoom.x": 1}, "has no 'zoom'"), ({"camera.fov": "wide"}, "overrides:1:12: error: .*fov"):
            with self.assertRaisesRegex(glint.SceneError, reason):
                glint.Scene(SPHERE, overrides=overrides)
        with self.assertRaisesRegex(glint.SceneError, "frame is not finite"):
            glint.Scene(SPHERE, frame=float("nan"))
        with self.assertRaisesRegex(glint.SceneError, "min_contribution is .*; expected 0 to 1"):
            glint.Scene(SPHERE).render(8, 6, min_contribution=2)
        mirror = glint.Scene(SPHERE)
        self.assertFalse(np.array_equal(mirror.render(32, 18), mirror.render(32, 18, min_contribution=0.5)))

    def test_sizes_and_meshes(self):
        self.assertEqual(glint.load_mesh(CUBE_VERTICES, CUBE_FACES).render(16, 9).shape, (9, 16, 3))
        scene = glint.Scene(SPHERE)
        seen = []
        self.assertEqual(scene.render(progress=seen.append).shape, (720, 1280, 3))
        self.assertTrue(seen == sorted(seen) and seen[-1] == 1)
        with self.assertRaises(glint.Stopped):
            scene.render(1280, 720, progress=lambda fraction: True)

    def test_smooth(self):
        flat, smooth = (glint.load_mesh(CUBE_VERTICES, CUBE_FACES, normals).render_layers(["normal"], 48, 36)["normal"]
                        for normals in (None, CUBE_VERTICES - 0.5))
        self.assertGreater(len(np.unique(smooth.reshape(-1, 3).round(6), axis=0)), 10 * len(np.unique(flat.reshape(-1, 3).round(6), axis=0)))


class Rays(unittest.TestCase):
    def test_hits(self):
        scene = glint.Scene(SPHERE)
        for dtype in np.float32, np.float64:
            for precision in glint.PRECISIONS:
                hits = scene.trace(np.array([[0, 0, -4], [0, 5, -4], [0, 0, 0]], dtype), np.array([[0, 0, 2], [0, 0, 1], [0, 3, 0]], dtype),
                                   precision=precision)
                self.assertEqual(hits.object.tolist(), [0, glint.MISS, 0])
                np.testing.assert_allclose(hits.t, [1.5, np.inf, 1 / 3], rtol=1e-6)
                np.testing.assert_allclose(hits.normal, [[0, 0, -1], [0, 0, 0], [0, -1, 0]], atol=1e-6)
                np.testing.assert_allclose(hits.position, [[0, 0, -1], [0, 0, 0], [0, 1, 0]], atol=1e-6)
                self.assertEqual(hits.certain.all(), precision == "certified")
                self.assertTrue(np.all((hits.low <= hits.t) & (hits.t <= hits.high)))
        hits = scene.trace([[0, 0, -4]] * 3, [0, 0, 1], precision="double", tmin=[0, 3, 3.5], tmax=[2.5, np.inf, np.inf])
        np.testing.assert_allclose(hits.t, [np.inf, 5, 5])
        # an end that float32 would round to beyond the hit
        origins, directions = np.float32([[0, 0, -4]]), np.float32([[0, 0, 10]])
        self.assertEqual(scene.trace(origins, directions, precision="certified", tmax=0.3 - 1e-10).hit.tolist(), [False])
        self.assertEqual(scene.trace(np.zeros((0, 3)), np.zeros((0, 3)), precision="certified").t.shape, (0,))
        self.assertEqual(scene.trace(np.array([[0, 0, -4.0]] * 4)[::2], [0, 0, 1]).object.tolist(), [0, 0])

    def test_bounds_hold(self):
        """Nothing that is certain differs from exact rational arithmetic on the rays' doubles, for a cube's faces at 0 and 1, in
        which many rays hit edges and diagonals."""
        random = np.random.default_rng(5)
        count = 2000
        targets = random.integers(0, 5, (count, 3)) / 4
        origins = random.normal(size=(count, 3)) * 3
        directions = targets - origins
        hits = glint.load_mesh(CUBE_VERTICES, CUBE_FACES).trace(origins, directions, precision="certified")
        certain = 0
        for origin, direction, t, low, high, is_certain in zip(origins, directions, hits.t, hits.low, hits.high, hits.certain):
            origin, direction = [Fraction(x) for x in origin], [Fraction(x) for x in direction]
            exact = []
            for axis in range(3):
                for face in (0, 1):
                    at = (face - origin[axis]) / direction[axis]
                    point = [o + at * d for o, d in zip(origin, direction)]
                    if at > 0 and all(0 <= x <= 1 for k, x in enumerate(point) if k != axis):
                        exact.append(at)
            if is_certain:
                certain += 1
                self.assertEqual(np.isfinite(t), bool(exact), (origin, direction))
                if exact:
                    self.assertTrue(Fraction(low) <= min(exact) <= Fraction(high), (origin, direction))
        self.assertTrue(count / 10 < certain < count, "some rays are open, many are not")

    def test_threads(self):
        """One scene, device and tracer serve several threads."""
        scene = glint.load_mesh(CUBE_VERTICES, CUBE_FACES)
        random = np.random.default_rng(1)
        origins, directions = random.normal(size=(20000, 3)) * 3, random.normal(size=(20000, 3))
        expected = scene.trace(origins, directions).object

        def work(i):
            return scene.trace(origins, directions).object if i % 2 else scene.render(64, 48)
        with ThreadPoolExecutor(4) as threads:
            found = list(threads.map(work, range(4)))
        for i in 1, 3:
            np.testing.assert_array_equal(found[i], expected)
        np.testing.assert_array_equal(found[0], found[2])

    def test_thread_that_waits_for_a_render(self):
        """A progress function may trace a scene while another thread waits for the device, to open a tracer of that scene."""
        scene, is_rendering, is_opening, open_tracer = glint.Scene(SPHERE), threading.Event(), threading.Event(), glint.Scene._tracer
        ray, done = ([[0, 0, -4]], [[0, 0, 1]]), []

        def tracer(*arguments):
            is_opening.set()
            return open_tracer(*arguments)

        def progress(_):
            is_rendering.set()
            self.assertTrue(is_opening.wait(60))
            scene.trace(*ray)

        def render():
            scene.render(64, 48, progress=progress)
            done.append("render")

        def trace():
            self.assertTrue(is_rendering.wait(60))
            scene.trace(*ray)
            done.append("trace")
        with mock.patch.object(glint.Scene, "_tracer", tracer):
            threads = [threading.Thread(target=target, daemon=True) for target in (render, trace)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join(60)
                self.assertFalse(thread.is_alive(), "the threads wait for each other")
        self.assertEqual(sorted(done), ["render", "trace"], "a thread raised an exception")
        self.assertEqual(len(scene._tracers), 1)


class Occlusion(unittest.TestCase):
    def test_shadows_of_a_sphere(self):
        """A sphere hides some points of a plane from a light. The rays do not fit in one batch."""
        scene = glint.Scene(SPHERE)
        points = np.random.default_rng(6).uniform(-4, 4, (70000, 3))
        points[:, 2] = 2
        light = np.array([0, 0.5, -3])
        offset = np.linalg.norm(np.cross(points - light, light) / np.linalg.norm(points - light, axis=1)[:, None], axis=1)
        clear = np.abs(offset - 1) > 1e-4
        for dtype in np.float32, np.float64:
            for precision in glint.PRECISIONS:
                rays = points.astype(dtype), (light - points).astype(dtype)
                occluded, certain = scene.occluded(*rays, precision=precision, tmax=dtype(1), return_certain=True)
                self.assertEqual((occluded.dtype, certain.dtype), (bool, bool))
                np.testing.assert_array_equal(occluded[clear], offset[clear] < 1)
                hits = scene.trace(*rays, precision=precision, tmax=dtype(1))
                np.testing.assert_array_equal(occluded, hits.hit)
                np.testing.assert_array_equal(certain, hits.certain)
                self.assertTrue(certain.mean() > 0.99 if precision == "certified" else not certain.any())
        self.assertTrue(0.05 < (offset < 1).mean() < 0.5)

    def test_shadows_of_a_render(self):
        """Rays from the light to the hit points of an image, with the advised tmax, find its shadows."""
        small = {"sphere": {"center": [1.2, 1.6, -2], "radius": 0.4}}
        scene = glint.Scene({**SPHERE, "objects": [*SPHERE["objects"], small]})
        layers = scene.render_layers(("object", "position", "shadow"), 64, 48, precision="double")
        hit = layers["object"] != glint.MISS
        points, shadow = layers["position"][hit], layers["shadow"][hit][:, 0] == 1
        light = np.broadcast_to([3.0, 4.0, -5.0], points.shape)
        for precision in "double", "certified":
            np.testing.assert_array_equal(scene.occluded(light, points - light, precision=precision, tmax=1 - 1e-6), shadow)
        facing = (layers["object"][hit] == 0) & (np.einsum("ij,ij->i", points, light) > 1.1)
        self.assertTrue(0 < (shadow & facing).sum() < facing.sum(), "the small sphere shades a part of the large one")

    def test_ends(self):
        """Only surfaces strictly between the ends occlude, here a cube's faces at t 1 and 2."""
        scene = glint.load_mesh(CUBE_VERTICES, CUBE_FACES)
        below, above = np.nextafter((1, 2), 0), np.nextafter((1, 2), 3)
        tmin, tmax = [0, 0, 0, 1, below[1], 2], [below[0], 1, above[0], 2, above[1], 3]
        occluded = scene.occluded([[0.25, 0.5, -1]] * 6, [0, 0, 1], precision="double", tmin=tmin, tmax=tmax)
        self.assertEqual(occluded.tolist(), [False, False, True, False, True, False])
        # certified compares the bounds of t with the end
        occluded, certain = scene.occluded([[0.25, 0.5, -1]] * 3, [0, 0, 1], precision="certified", tmax=[0.999, 1, 1.001], return_certain=True)
        self.assertEqual((occluded.tolist(), certain.tolist()), ([False, False, True], [True, False, True]))
        self.assertEqual(scene.occluded(np.zeros((0, 3)), np.zeros((0, 3))).shape, (0,))
        directions = np.tile([0.0, 0, 1], (300000, 1))
        directions[[299999, 290000, 270000]] = 0  # in the second batch, read by several threads
        for trace in scene.occluded, scene.trace, scene.trace_all:
            with self.assertRaisesRegex(glint.SceneError, "ray 270000: a ray.s direction cannot be 0 0 0"):
                trace(np.zeros_like(directions), directions)


class Compare(unittest.TestCase):
    def test_equals_the_program(self):
        """The metrics are those that glint diff reports of NPY files with the arrays."""
        random = np.random.default_rng(7)
        color = random.uniform(-0.2, 1.3, (18, 32, 3))
        other = color + random.normal(size=color.shape) * 10.0 ** random.uniform(-6, -2, color.shape)
        t = np.where(color[:, :, 0] < 0, np.inf, 5 + color[:, :, 0])
        broken = other.copy()
        broken[3, 4, 1], broken[5, 6] = np.nan, np.inf
        for reference, image in (color, other), (color, broken), (broken, broken), (t, t + 1e-9), (t, other[:, :, 0]), (color[:, :, :2], other[:, :, 1:]):
            for dtype in np.float32, np.float64:
                arrays = reference.astype(dtype), image.astype(dtype)
                metrics = glint.compare(*arrays)
                with tempfile.TemporaryDirectory() as folder:
                    paths = [f"{folder}/{i}.npy" for i in range(2)]
                    for path, array in zip(paths, arrays):
                        np.save(path, array)
                    report = json.loads(subprocess.run([BUILD / "glint", "diff", *paths, "--format", "json"], check=False, capture_output=True).stdout)
                linear, pixels, worst = report["linear"], report["nonfinite_pixels"], report["worst"]
                srgb8, flip = report.get("srgb8", {"off_by_1": 0, "off_by_2_or_more": 0, "psnr": None}), report.get("flip", {"mean": None, "max": None})
                expected = [report["differing_values"], report["unmatched_values"], pixels["reference"], pixels["image"], linear["values"],
                            linear["max_abs"], linear["rmse"], linear["bias"], linear["p99_9"], linear["psnr"], linear["rel_mse"], report["max_ulp"],
                            worst["x"], worst["y"], srgb8["off_by_1"], srgb8["off_by_2_or_more"], srgb8["psnr"], flip["mean"], flip["max"]]
                found = [value if np.isfinite(value) else None for value in dataclasses.astuple(metrics)]
                self.assertEqual(found, expected)

    def test_accuracy_of_a_precision(self):
        """The error of a render in float is its difference from one in double. A distance in float is as many ulp off."""
        scene = glint.Scene(SPHERE)
        single, strict, double = (scene.render_layers(("color", "t"), 64, 48, precision=precision) for precision in ("single", "strict", "double"))
        for image in single, strict:
            error = glint.compare(double["color"], image["color"])
            self.assertTrue(0 < error.rmse < 1e-5 and error.max_abs < 1e-4 and error.flip_mean < 1e-4 and error.psnr > 100, error)
            ulp = glint.compare(double["t"].astype(np.float32), image["t"].astype(np.float32)).max_ulp
            self.assertTrue(0 < ulp < 100, ulp)
        equal = glint.compare(double["color"], double["color"].copy())
        self.assertEqual((equal.differing_values, equal.rmse, equal.psnr, equal.flip_max), (0, 0, np.inf, 0))

    def test_shapes(self):
        metrics = glint.compare([1, 2, 3], np.array([1, 2.5, 3]))
        self.assertEqual((metrics.compared_values, metrics.max_abs, metrics.worst_x, metrics.worst_y), (3, 0.5, 1, 0))
        image = np.random.default_rng(8).random((9, 16, 3))
        self.assertEqual(glint.compare(image[::-1, ::2], np.flipud(image)[:, ::2].copy()).differing_values, 0)
        for wrong in (image, image[:8]), (image, image[:, :, 0]), (image[None], image[None]):
            with self.assertRaisesRegex(ValueError, "of one shape"):
                glint.compare(*wrong)
        for wrong, message in ((image[:, :0],) * 2, "in floating point, or color=False, not float64 of shape"), ((np.uint8([[[1, 2, 3]]]),) * 2, "not uint8"), \
                (([1j], [1j]), "real numbers, not complex"), ((image, image[:, :, 0]), "of one shape"):
            with self.assertRaisesRegex(ValueError, message):
                glint.compare(*wrong)
        with self.assertRaisesRegex(ValueError, "colors have the shape"):
            glint.compare([1.0], [2.0], color=True)

    def test_data(self):
        """Three channels are colors or data, as the caller chooses. Without comparable values errors are NaN."""
        normals = np.random.default_rng(9).uniform(-1, 1, (9, 16, 3))
        color, data = (glint.compare(normals, -normals, color=is_color) for is_color in (True, False))
        self.assertEqual((data.rmse, data.srgb8_off_by_2_or_more), (color.rmse, 0))
        self.assertTrue(color.flip_max > 0.5 and np.isnan(data.flip_max))
        nothing = glint.compare(normals, normals * np.nan)
        self.assertEqual((nothing.compared_values, nothing.unmatched_values), (0, normals.size))
        self.assertTrue(all(np.isnan(value) for value in (nothing.max_abs, nothing.rmse, nothing.bias, nothing.p99_9, nothing.psnr, nothing.rel_mse)))
        pair = glint._c.ImagePair(ctypes.sizeof(glint._c.ImagePair), 1, 1 << 31, 1 << 31, 4, normals.ctypes.data, normals.ctypes.data)
        metrics, messages = glint._c.ImageMetrics(ctypes.sizeof(glint._c.ImageMetrics)), ctypes.c_void_p()
        for found in ctypes.byref(metrics), None:
            self.assertEqual(glint._c.library.glint_images_compare(ctypes.byref(pair), found, ctypes.byref(messages)), 1)
            glint._c.library.glint_text_free(messages)
            pair.width = pair.height = pair.channels = 1

    def test_other_versions(self):
        """A caller of an earlier version gets the metrics that it knows, and one of a later version 0 for those that this one lacks."""
        reference, image = np.zeros((2, 2, 3)), np.ones((2, 2, 3))
        pair = glint._c.ImagePair(ctypes.sizeof(glint._c.ImagePair), 1, 2, 2, 3, reference.ctypes.data, image.ctypes.data)

        class Later(glint._c.ImageMetrics):
            _fields_ = [("later", ctypes.c_uint64), ("beyond", ctypes.c_uint64)]
        earlier, own, later = Later.unmatched_values.offset, ctypes.sizeof(glint._c.ImageMetrics), Later.beyond.offset
        for size in 0, earlier, own, later:
            metrics, messages = Later(size=size, differing_values=7, unmatched_values=7, later=7, beyond=7), ctypes.c_void_p()
            status = glint._c.library.glint_images_compare(ctypes.byref(pair), ctypes.byref(metrics), ctypes.byref(messages))
            self.assertEqual((status, bool(messages)), (0, False) if size else (1, True))
            glint._c.library.glint_text_free(messages)
            self.assertEqual((metrics.size, metrics.differing_values, metrics.unmatched_values, metrics.later, metrics.beyond),
                             (size, 12 if size else 7, 0 if size >= own else 7, 0 if size == later else 7, 7))


class AllHits(unittest.TestCase):
    def setUp(self):
        self.scene = glint.Scene({**SPHERE, "objects": [sphere(radius) for radius in range(1, 6)]})

    def test_order(self):
        """Rays pass through concentric spheres and next to them, and start inside them. They do not fit in one batch."""
        count = 70000
        origins = np.zeros((count, 3))
        origins[:, 0] = np.random.default_rng(3).uniform(0, 6, count)
        origins[::2, 2] = -8
        found = self.scene.trace_all(origins, [0, 0, 2])
        squares = np.arange(1, 6)[None, :] ** 2 - origins[:, :1] ** 2
        roots = np.sqrt(np.maximum(squares, 0))
        depths = np.concatenate([-roots[:, ::-1], roots], axis=1)  # of 5 entries, the largest sphere first, and 5 exits
        is_hit = np.concatenate([squares[:, ::-1], squares], axis=1) > 0
        is_hit &= depths > origins[:, 2:]
        np.testing.assert_array_equal(found.ray, np.nonzero(is_hit)[0])
        np.testing.assert_array_equal(found.object, np.tile([4, 3, 2, 1, 0, 0, 1, 2, 3, 4], (count, 1))[is_hit])
        np.testing.assert_allclose(found.t, (0.5 * (depths - origins[:, 2:]))[is_hit], atol=1e-6)
        np.testing.assert_allclose(found.position, np.stack([origins[found.ray, 0], 0 * found.t, depths[is_hit]], 1), atol=1e-6)
        self.assertTrue(np.all(found.normal[:, 2] < 0))  # they face the rays
        nearest = self.scene.trace(origins, [0, 0, 2], precision="double")
        firsts = np.unique(found.ray, return_index=True)[1]
        np.testing.assert_array_equal(found.t[firsts], nearest.t[nearest.hit])

    def test_far_transformed_shapes(self):
        """Each ray through the middle has an entry and an exit, however far away it starts. The other shapes are above the rays, so
        that the same kernels serve each."""
        shapes = (("sphere", {"center": [0, 0, 0], "radius": 1}, 2), ("cylinder", {"from": [0, -1, 0], "to": [0, 1, 0], "radius": 1}, 2),
                  ("torus", {"center": [0, 0, 0], "axis": [0, 1, 0], "major": 1, "minor": 0.25}, 4))
        for shape, _, hits in shapes:
            scene = glint.Scene({**SPHERE, "objects": [
                {name: {**keys, "transform": {"scale": [1, 2, 1.5], "translate": [0, 0 if name == shape else 100, 0]}}}
                for name, keys, _ in shapes]})
            for distance in 10, 1e3, 1e4:
                angle, slope = np.random.default_rng(4).uniform(-np.pi, np.pi, (2, 1000))
                away = np.stack([np.cos(angle), 0.05 * slope, np.sin(angle)], 1)
                origins = distance * away
                for precision in "single", "strict", "double":
                    found = scene.trace_all(origins, -away, precision=precision)
                    self.assertTrue(np.all(np.bincount(found.ray, minlength=1000) == hits), (shape, distance, precision))

    def test_limits(self):
        origins, directions = np.array([[0, 0, -8], [9, 0, 0]], np.float32), np.array([[0, 0, 1], [0, 0, 1]], np.float32)
        for precision in "single", "strict", "double":
            self.assertEqual(self.scene.trace_all(origins, directions, precision=precision).ray.tolist(), [0] * 10)
            found = self.scene.trace_all(origins, directions, precision=precision, hits_max=3)
            self.assertEqual((found.ray.tolist(), found.object.tolist(), found.t.tolist()), ([0] * 3, [4, 3, 2], [3, 4, 5]))
        found = self.scene.trace_all(origins, directions, tmin=3.5, tmax=7.5)
        self.assertEqual(found.object.tolist(), [3, 2, 1, 0])
        for none in (self.scene.trace_all(origins, directions, hits_max=0), self.scene.trace_all(origins[1:], directions[1:]),
                     self.scene.trace_all(origins[:0], directions[:0])):
            self.assertEqual([array.shape for array in none], [(0,), (0,), (0,), (0, 3), (0, 3)])
        with self.assertRaisesRegex(glint.SceneError, "precision certified cannot trace all hits"):
            self.scene.trace_all(origins, directions, precision="certified")
        with self.assertRaisesRegex(glint.SceneError, "ray 1: a ray.s direction cannot be 0 0 0"):
            self.scene.trace_all(origins, [[0, 0, 1], [0, 0, 0]])


class Trimesh(unittest.TestCase):
    def test_queries(self):
        intersector = glint.trimesh.RayMeshIntersector(Mesh)
        origins, directions = np.array([[0.25, 0.5, -1], [0.25, 0.5, 2], [3, 3, 3], [0.3, 0.6, 0.5]]), np.array([[0, 0, 2], [0, 0, 1], [1, 0, 0], [0, 0, -1]])
        self.assertEqual(intersector.intersects_any(origins, directions).tolist(), [True, False, False, True])
        first = intersector.intersects_first(origins, directions)
        self.assertEqual((first >= 0).tolist(), [True, False, False, True])
        locations, rays, triangles = intersector.intersects_location(origins, directions)
        self.assertEqual(rays.tolist(), [0, 0, 3])
        np.testing.assert_allclose(locations, [[0.25, 0.5, 0], [0.25, 0.5, 1], [0.3, 0.6, 0]], atol=1e-12)
        self.assertEqual(triangles[[0, 2]].tolist(), first[[0, 3]].tolist())
        triangles, rays = intersector.intersects_id(origins, directions, multiple_hits=False)
        self.assertEqual((rays.tolist(), triangles.tolist()), ([0, 3], first[[0, 3]].tolist()))
        self.assertEqual([len(array) for array in intersector.intersects_id(origins[2:3], directions[2:3], return_locations=True)], [0, 0, 0])

    def test_many_hits(self):
        """All hits of a ray have locations, and the nearest 20 have ids unless another number is given."""
        class Stack:
            vertices = [[x, y, z] for z in range(30) for x, y in ((-1, -1), (1, -1), (0, 1))]
            faces = np.arange(90).reshape(30, 3)
        intersector, ray = glint.trimesh.RayMeshIntersector(Stack), ([[0.1, 0.2, -1]], [[0, 0, 1]])
        for most, expected in ((), 30), ((7,), 7):
            self.assertEqual([len(array) for array in intersector.intersects_location(*ray, True, *most)], [expected] * 3)
        for most, expected in ((), 20), ((None,), 30):
            self.assertEqual([array.tolist() for array in intersector.intersects_id(*ray, True, *most)], [list(range(expected)), [0] * expected])

    def test_contains(self):
        points = np.random.default_rng(2).uniform(-0.5, 1.5, (500, 3))
        inside = glint.trimesh.RayMeshIntersector(Mesh).contains_points(points)
        self.assertEqual(inside.tolist(), np.all((points > 0) & (points < 1), axis=1).tolist())


@unittest.skipUnless(IS_LONG, "takes matplotlib")
class Notebook(unittest.TestCase):
    def test_results(self):
        """The notebook's code runs and reproduces the errors that it shows."""
        import matplotlib
        matplotlib.use("Agg")
        cells = json.loads((ROOT / "docs/notebook.ipynb").read_text(encoding="utf-8"))["cells"]
        names, folder = {}, os.getcwd()
        os.chdir(ROOT / "docs")
        try:
            for cell in cells:
                if cell["cell_type"] == "code":
                    exec("".join(cell["source"]), names)  # pylint: disable=exec-used
        finally:
            os.chdir(folder)
        worst = names["worst"]
        self.assertGreater(min(worst["textbook"][3:]), 1000)
        self.assertLess(max(worst["single"]), 10)
        self.assertLess(max(worst["strict"][2:]), 4)
        self.assertEqual(names["image"].shape, (270, 480, 3))


if __name__ == "__main__":
    unittest.main()
