"""Provides the Python package of host/python over the build's library, for its tests, and what they trace."""
import os
import sys

from glint import IS_LONG, IS_SANITIZED, ROOT, need_modules, skip_all

if IS_SANITIZED:
    skip_all("Python does not start with a sanitizer's runtime")
need_modules("numpy=numpy==2.4.6", *(["matplotlib=matplotlib==3.11.2"] if IS_LONG else []))
del sys.modules["glint"]  # the tests' own module, not the package
BUILD = ROOT / os.environ.get("BUILD", "build")
os.environ["GLINT_LIBRARY"] = str(BUILD / "libglint.so.1")
os.environ.pop("GLINT_DEVICE", None)
sys.path.insert(0, str(ROOT / "host/python"))
import numpy as np  # noqa: E402

import glint  # noqa: E402
import glint.trimesh  # noqa: E402

CUBE_VERTICES = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE_FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
                       [1, 5, 7], [1, 7, 3]])


def sphere(radius):
    return {"sphere": {"center": [0, 0, 0], "radius": radius, "material": {"reflection": 0.1}}}


# with the features of glint.py's SPHERE, so that the same kernels serve both
SPHERE = {"camera": {"position": [0, 0, -4], "look_at": [0, 0, 0], "fov": 60}, "background": [0.1, 0.2, 0.4],
          "lights": [{"point": {"position": [3, 4, -5]}}], "objects": [sphere(1)]}
