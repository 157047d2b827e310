"""Renders scenes and traces rays on OpenCL devices, with a bound on the error of each hit.

    import glint
    scene = glint.load("scene.yaml")            # or a mesh or glTF file, glint.Scene(dict), glint.load_mesh(…)
    image = scene.render(640, 360)              # (360, 640, 3), linear light
    hits = scene.trace(origins, directions, precision="certified")
    hits.object[hits.certain]                   # proven equal to the result of exact arithmetic

Settings are keyword arguments. Every call that computes releases Python's global lock, so threads may share a scene; calls on one device
run one after the other. A wrong scene or setting raises SceneError, another wrong argument ValueError, of which SceneError is a subclass, and
a failing device DeviceError. Warnings have the category GlintWarning. Nothing is printed.
"""
from __future__ import annotations

import ctypes
import json
import os
import threading
from dataclasses import dataclass, fields
from typing import Any, Callable, Literal, Mapping, NamedTuple, Optional, Sequence, Union, overload

import numpy as np

from . import _handles as _h, _library as _c
from ._handles import DeviceError, GlintWarning, SceneError, Selector, Stopped

for _public in DeviceError, GlintWarning, SceneError, Stopped:
    _public.__module__ = __name__

__all__ = ["AllHits", "Device", "DeviceError", "GlintWarning", "Hits", "ImageMetrics", "LAYERS", "MISS", "PRECISIONS", "Scene", "SceneError",
           "Selector", "Stopped", "compare", "devices", "load", "load_mesh", "version"]

MISS = 0xFFFFFFFF  #: the object of a miss
PRECISIONS = {"single": 0, "strict": 1, "double": 2, "certified": 3}
#: The layers of an image, with their values per pixel (0 means one per light) and their type. color and backdrop are linear light; coverage is
#: from 0 to 1. The others describe the ray through the pixel's center: t is the distance from the camera, normal is a unit vector, position is
#: the hit point in the scene's coordinates, and shadow is 1 where a light is occluded. On a miss t is inf, normal and position are 0, and object
#: is MISS. At "certified", flag is 1 where the pixel is re-rendered in double and 2 where it is uncertified, else 0.
LAYERS = {"color": (3, np.float64), "t": (1, np.float64), "normal": (3, np.float64), "position": (3, np.float64),
          "object": (1, np.uint32), "shadow": (0, np.uint32), "flag": (1, np.uint32),
          "coverage": (1, np.float64), "backdrop": (3, np.float64)}


def version() -> str:
    """Returns the library's version."""
    return _c.library.glint_version().decode()


class Device(NamedTuple):
    """An OpenCL device. memory_bytes is 0 if unknown. is_usable: whether glint can render with it."""
    index: int  #: its Selector
    name: str
    platform: str
    driver: str
    compute_units: int
    memory_bytes: int
    is_gpu: bool
    is_cpu: bool
    has_double: bool
    is_usable: bool


def devices() -> list[Device]:
    """Lists the devices of all platforms. Raises DeviceError if a platform fails."""
    count = ctypes.c_size_t()
    _h.call(_c.library.glint_devices_list, None, 0, ctypes.byref(count))
    infos = (_c.DeviceInfo * count.value)()
    for info in infos:
        info.size = ctypes.sizeof(_c.DeviceInfo)
    _h.call(_c.library.glint_devices_list, infos, len(infos), ctypes.byref(count))
    return [Device(info.index, info.name.decode(), info.platform.decode(), info.driver.decode(), info.compute_units,
                   info.memory_bytes, bool(info.is_gpu), bool(info.is_cpu), bool(info.has_double), bool(info.is_usable))
            for info in infos[:min(count.value, len(infos))]]


class Hits(NamedTuple):
    """The nearest hits of n rays. On a miss object is MISS, t, low and high are inf, and normal and position are 0."""
    object: np.ndarray  #: (n,) uint32: the object's number, for glint.load_mesh the index of the face
    t: np.ndarray  #: (n,) float64: in lengths of the direction
    low: np.ndarray  #: (n,) float64: the lower bound on the exact t where certain, otherwise t
    high: np.ndarray  #: (n,) float64: the upper bound
    normal: np.ndarray  #: (n, 3) float64: geometric, a unit vector that faces the ray
    position: np.ndarray  #: (n, 3) float64: the hit point, moved onto the surface
    certainty: np.ndarray  #: (n,) uint8: 0 uncertain, 1 proven in float, 2 proven in double; always 0 below precision "certified"

    @property
    def hit(self) -> np.ndarray:
        """Whether each ray hits something, as n bools."""
        return self.object != MISS

    @property
    def certain(self) -> np.ndarray:
        """Whether the object or miss and the bounds on t are proven, as n bools."""
        return self.certainty != 0


class AllHits(NamedTuple):
    """All hits of rays: arrays with one row per hit, sorted by ray and then by t. Members other than `ray` are as in Hits."""
    ray: np.ndarray  #: int64: the index of each hit's ray
    object: np.ndarray
    t: np.ndarray
    normal: np.ndarray
    position: np.ndarray


def _reals(array: Any, columns: int, count: Optional[int], name: str, dtype: Any) -> np.ndarray:
    """Returns a contiguous array. If `count` is given, repeats a single row or number to that many rows."""
    array = np.asarray(array, dtype)
    shape = (count, columns) if columns > 1 else (count,)
    if count is not None:
        try:
            array = np.broadcast_to(array, shape)
        except ValueError:
            raise ValueError(f"{name}: expected shape {shape}, not {array.shape}") from None
    elif array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{name}: expected shape (n, {columns}), not {array.shape}")
    return np.ascontiguousarray(array)


def _precision(name: str) -> int:
    if name not in PRECISIONS:
        raise ValueError(f"precision: expected one of {', '.join(PRECISIONS)}, not {name!r}")
    return PRECISIONS[name]


def _plain(value: Any) -> Any:
    """Returns a path as text, and arrays and numbers of NumPy as those of Python."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a scene cannot contain a {type(value).__name__}")


def _yaml(value: Any) -> str:
    """Returns a value as JSON, which is YAML."""
    try:
        return json.dumps(value, default=_plain)
    except TypeError as error:
        raise ValueError(str(error)) from None


def _options(overrides: Optional[Mapping[str, Any]], frame: float, max_pixels: int, camera: Optional[bytes] = None) -> Any:
    texts = [f"{path}={value if isinstance(value, str) else _yaml(value)}".encode() for path, value in (overrides or {}).items()]
    return _c.SceneOptions(ctypes.sizeof(_c.SceneOptions), (ctypes.c_char_p * len(texts))(*texts), len(texts), frame, camera,
                           _h.uint32("max_pixels", max_pixels))


class Scene:
    """A scene made from a dict or text in glint's YAML format. glint.load and glint.load_mesh make scenes from files and arrays."""

    def __init__(self, description: Union[str, Mapping[str, Any]], *, name: str = "scene.yaml", overrides: Optional[Mapping[str, Any]] = None,
                 frame: float = 0, max_pixels: int = 0):
        """Reads the description. Raises SceneError with the place of each mistake.

        name: the file name in messages; files that the scene names are relative to its folder. overrides: values to replace, such as
        {"camera.fov": 60}; a string is YAML, and an empty one removes the key. frame: the frame of an animated scene. max_pixels: images
        of the scene with more pixels are refused; 0 means 134217728.
        """
        text = description if isinstance(description, str) else _yaml(description)
        encoded = text.encode()
        options = _options(overrides, frame, max_pixels)
        self._adopt(lambda scene, messages: _c.library.glint_scene_parse(encoded, len(encoded), os.fsencode(name), ctypes.byref(options),
                                                                        scene, messages))

    def _adopt(self, make: Callable[[Any, Any], int]) -> None:
        """Sets the handle by a function that sets it and the messages, and returns a status."""
        self._handle = _h.Handle(make, _c.library.glint_scene_free)
        self._tracers: dict[tuple[_h.Handle, int, int], _h.Handle] = {}  # by device, precision and lanes
        self._lock = threading.Lock()  # of the tracers; never held during a call of the library, which may wait for a device
        _h.device_users_add(self)

    def __reduce__(self) -> Any:
        raise TypeError("a Scene cannot be copied or pickled")

    @property
    def object_count(self) -> int:
        """The number of objects, of which each triangle of a mesh is one."""
        return _c.library.glint_scene_object_count(self._handle)

    @property
    def light_count(self) -> int:
        """The number of lights."""
        return _c.library.glint_scene_light_count(self._handle)

    @property
    def frame_count(self) -> int:
        """The number of frames that an animated scene names, or 0."""
        return _c.library.glint_scene_frame_count(self._handle)

    def render(self, width: int = 0, height: int = 0, *, samples: int = 1, bounces: int = 5, precision: str = "single",
               device: Selector = None, lanes: int = 0, progress: Optional[Callable[[float], Any]] = None,
               min_contribution: float = 0) -> np.ndarray:
        """Returns the image, an array of (height, width, 3) float64 in linear light, from the top left. The arguments are those of
        render_layers."""
        return self.render_layers(("color",), width, height, samples=samples, bounces=bounces, precision=precision, device=device,
                                  lanes=lanes, progress=progress, min_contribution=min_contribution)["color"]

    def render_layers(self, layers: Sequence[str], width: int = 0, height: int = 0, *, samples: int = 1, bounces: int = 5,
                      precision: str = "single", device: Selector = None, lanes: int = 0,
                      progress: Optional[Callable[[float], Any]] = None, min_contribution: float = 0) -> dict[str, np.ndarray]:
        """Renders the named layers of glint.LAYERS and returns their arrays by name, of shape (height, width[, values]).

        width, height: in pixels; both 0 select the size in the scene's file, or one that is 1280 wide. samples: per pixel, 1 to 1048576.
        bounces: the maximum per ray, 0 to 255. precision: a key of PRECISIONS. lanes: rays per work-item, 1, 4, 8 or 16; 0 lets glint
        choose. progress: called with the fraction that is done, from this thread; if it returns a true value, Stopped is raised.
        min_contribution: 0 to 1; rays whose weight in the pixel is lower are not traced.
        """
        if isinstance(layers, str):
            raise ValueError("layers: expected a sequence of names, not one text")
        unknown = set(layers) - set(LAYERS)
        if unknown:
            raise ValueError(f"layers: expected some of {', '.join(LAYERS)}, not {', '.join(sorted(unknown))}")
        if samples < 1:
            raise ValueError(f"samples: expected 1 to 1048576, not {samples}")
        counts = (_h.uint32(name, value) for name, value in (("width", width), ("height", height), ("samples", samples), ("bounces", bounces)))
        settings = _c.RenderSettings(ctypes.sizeof(_c.RenderSettings), *counts, _precision(precision), _h.uint32("lanes", lanes),
                                     min_contribution=min_contribution)
        if not width and not height:
            sides = ctypes.c_uint32(), ctypes.c_uint32()
            _c.library.glint_scene_image_size(self._handle, *map(ctypes.byref, sides))
            settings.width, settings.height = width, height = sides[0].value, sides[1].value
        raised: list[BaseException] = []

        def report(_: Any, fraction: float) -> int:
            try:
                return 1 if progress(fraction) else 0
            except BaseException as exception:  # ctypes would print and drop it
                raised.append(exception)
                return 1
        if progress:
            settings.progress = _c.Progress(report)
        arrays = {}
        for name in {"color", *layers}:
            values, dtype = LAYERS[name]
            arrays[name] = np.zeros((height, width) if values == 1 else (height, width, values or self.light_count), dtype)
        image = _c.Image(ctypes.sizeof(_c.Image), **{name: _h.pointer(array) for name, array in arrays.items()})
        try:
            with _h.device_opened(device) as opened:
                _h.call(_c.library.glint_render, opened, self._handle, ctypes.byref(settings), ctypes.byref(image))
        except (Stopped, DeviceError):
            if not raised:
                raise
        if raised:
            raise raised[0]
        return {name: arrays[name] for name in layers}

    def trace(self, origins: Any, directions: Any, *, precision: str = "single", tmin: Any = None, tmax: Any = None,
              device: Selector = None, lanes: int = 0) -> Hits:
        """Finds the nearest hit of each ray strictly between tmin and tmax, in lengths of the direction.

        origins, directions: (n, 3) finite numbers; one direction serves all rays. Directions have any length but 0. tmin, tmax: one
        number or n; None means 0 and inf. At "certified" tmin must be 0. Arrays are passed as float32 if all are float32, else as
        float64. Raises ValueError for other shapes, and SceneError with the index of an invalid ray.
        """
        rays = _rays(origins, directions, tmin, tmax)
        count = rays.count
        hits = Hits(np.empty(count, np.uint32), *(np.empty(count) for _ in range(3)), np.empty((count, 3)), np.empty((count, 3)),
                    np.empty(count, np.uint8))
        found = _c.Hits(ctypes.sizeof(_c.Hits), *map(_h.pointer, hits))
        self._trace(_c.library.glint_trace, device, precision, lanes, ctypes.byref(rays), ctypes.byref(found))
        return hits

    @overload
    def occluded(self, origins: Any, directions: Any, *, precision: str = ..., tmin: Any = ..., tmax: Any = ...,
                 device: Selector = ..., lanes: int = ..., return_certain: Literal[False] = ...) -> np.ndarray: ...

    @overload
    def occluded(self, origins: Any, directions: Any, *, precision: str = ..., tmin: Any = ..., tmax: Any = ...,
                 device: Selector = ..., lanes: int = ..., return_certain: Literal[True]) -> tuple[np.ndarray, np.ndarray]: ...

    def occluded(self, origins: Any, directions: Any, *, precision: str = "single", tmin: Any = None, tmax: Any = None,
                 device: Selector = None, lanes: int = 0, return_certain: bool = False) -> Any:
        """Returns whether anything lies strictly between tmin and tmax of each ray, as n bools.

        For shadows, trace from the light, or from outside the scene if it is directional, to the points at "double" or
        "certified", with tmax=1 - 1e-6. A ray that starts at a hit point, which is rounded, may re-hit the same surface.
        return_certain: whether to return a second array, which is True where the first is proven, at "certified".
        This takes as long as `trace`, whose other arguments it shares, but returns 1 or 2 bytes per ray instead of 77.
        """
        rays = _rays(origins, directions, tmin, tmax)
        occluded, certainty = np.empty(rays.count, bool), np.empty(rays.count, np.uint8) if return_certain else None
        found = _c.Occlusion(ctypes.sizeof(_c.Occlusion), _h.pointer(occluded), _h.pointer(certainty))
        self._trace(_c.library.glint_trace_occlusion, device, precision, lanes, ctypes.byref(rays), ctypes.byref(found))
        return occluded if certainty is None else (occluded, certainty != 0)

    def trace_all(self, origins: Any, directions: Any, *, precision: str = "double", tmin: Any = None, tmax: Any = None,
                  hits_max: Optional[int] = None, device: Selector = None, lanes: int = 0) -> AllHits:
        """Finds all hits of each ray, or the nearest hits_max. If several hits have the same t, it finds one. The other arguments are
        those of `trace`, but precision must not be "certified"."""
        rays = _rays(origins, directions, tmin, tmax)
        found = _c.AllHits(ctypes.sizeof(_c.AllHits))
        most = ctypes.c_size_t(-1) if hits_max is None else _h.uint32("hits_max", hits_max)
        try:
            self._trace(_c.library.glint_trace_all, device, precision, lanes, ctypes.byref(rays), most, ctypes.byref(found))
            count = found.count
            arrays = (_copied(found.ray, (count,), np.uintp), _copied(found.object, (count,), np.uint32),
                      _copied(found.t, (count,), np.float64), _copied(found.normal, (count, 3), np.float64),
                      _copied(found.position, (count, 3), np.float64))
        finally:
            _c.library.glint_all_hits_free(ctypes.byref(found))
        return AllHits(arrays[0].astype(np.int64), *arrays[1:])

    def _trace(self, function: Any, device: Selector, precision: str, lanes: int, *arguments: Any) -> None:
        """Calls a function that traces. The tracer is kept for later calls with the same settings, unless the device fails."""
        with _h.device_opened(device) as opened:
            key = opened, _precision(precision), _h.uint32("lanes", lanes)
            with self._lock:
                tracer = self._tracers.get(key)
            if not tracer:
                made = self._tracer(*key)
                with self._lock:
                    tracer = self._tracers.setdefault(key, made)
            _h.call(function, tracer, *arguments)

    def _device_forget(self, device: _h.Handle) -> None:
        """Closes the tracers of a device, which failed."""
        with self._lock:
            dropped = self._tracers  # which are closed after the lock is released
            self._tracers = {key: tracer for key, tracer in dropped.items() if key[0] is not device}

    def _tracer(self, device: _h.Handle, precision: int, lanes: int) -> _h.Handle:
        settings = _c.TraceSettings(ctypes.sizeof(_c.TraceSettings), precision, lanes)
        return _h.Handle(lambda handle, messages: _c.library.glint_tracer_open(device, self._handle, ctypes.byref(settings), handle, messages),
                         _c.library.glint_tracer_close, device)


def _rays(origins: Any, directions: Any, tmin: Any, tmax: Any) -> Any:
    """Returns the rays as a struct that keeps its arrays alive."""
    given = [array for array in (origins, directions, tmin, tmax) if array is not None]
    is_float = all(getattr(array, "dtype", None) == np.float32 for array in given)
    dtype = np.float32 if is_float else np.float64
    origins = _reals(origins, 3, None, "origins", dtype)
    count = len(origins)
    directions = _reals(directions, 3, count, "directions", dtype)
    tmin = None if tmin is None else _reals(tmin, 1, count, "tmin", dtype)
    tmax = None if tmax is None else _reals(tmax, 1, count, "tmax", dtype)
    arrays = origins, directions, tmin, tmax
    rays = _c.Rays(ctypes.sizeof(_c.Rays), count, 0 if is_float else 1, *map(_h.pointer, arrays))
    rays.arrays = arrays
    return rays


def _copied(pointer: Any, shape: tuple[int, ...], dtype: Any) -> np.ndarray:
    """Returns a copy of an array of the library, which is NULL if the shape has no rows."""
    return np.ctypeslib.as_array(pointer, shape).astype(dtype, copy=True) if shape[0] else np.empty(shape, dtype)


@dataclass(frozen=True)
class ImageMetrics:
    """The differences between an image and its reference: the figures of `glint diff`, with the names of its JSON report.

    max_abs to rel_mse compare the values that are finite in both, and are NaN if there are none. max_ulp is in units in the last place
    of the arrays' type. srgb8_off_by_1 to flip_max compare colors as a screen shows them, and are 0 or NaN for data.
    """
    differing_values: int  #: pairs that differ in any bit
    unmatched_values: int  #: pairs in which one is infinite or NaN and the other is not the same
    nonfinite_reference: int  #: pixels
    nonfinite_image: int
    compared_values: int
    max_abs: float
    rmse: float
    bias: float
    p99_9: float
    psnr: float
    rel_mse: float
    max_ulp: float
    worst_x: int
    worst_y: int
    srgb8_off_by_1: int
    srgb8_off_by_2_or_more: int
    srgb8_psnr: float
    flip_mean: float
    flip_max: float


def compare(reference: Any, image: Any, *, color: Optional[bool] = None) -> ImageMetrics:
    """Compares an image with its reference. Both arrays have the same shape, (height, width, channels) or fewer dimensions, and at least one
    value. Raises ValueError if they do not.

    color: whether they are colors in linear light, of a floating-point type, by default if there are 3 channels. Set it to False for data,
    such as normals. Arrays of other shapes, such as t, are data. Arrays are compared as float32 if both are, else as float64.
    """
    given = np.asarray(reference), np.asarray(image)
    shape = given[0].shape
    if shape != given[1].shape or not 1 <= len(shape) <= 3:
        raise ValueError(f"compare: expected two arrays of one shape with 1 to 3 dimensions, not {shape} and {given[1].shape}")
    is_color = shape[2:] == (3,) if color is None else color
    if is_color and shape[2:] != (3,):
        raise ValueError(f"compare: colors have the shape (height, width, 3), not {shape}")
    for array in given:
        if array.size == 0 or array.dtype.kind not in ("f" if is_color else "fiub"):
            expected = "colors in floating point, or color=False" if is_color else "real numbers"
            raise ValueError(f"compare: expected {expected}, not {array.dtype} of shape {shape}")
    dtype = np.float32 if all(array.dtype == np.float32 for array in given) else np.float64
    arrays = [np.ascontiguousarray(array, dtype) for array in given]
    height, width, channels = (_h.uint32("compare", side) for side in {1: (1, *shape, 1), 2: (*shape, 1), 3: shape}[len(shape)])
    pair = _c.ImagePair(ctypes.sizeof(_c.ImagePair), 0 if dtype == np.float32 else 1, width, height, channels, *map(_h.pointer, arrays), not is_color)
    found = _c.ImageMetrics(ctypes.sizeof(_c.ImageMetrics))
    _h.call(_c.library.glint_images_compare, ctypes.byref(pair), ctypes.byref(found))
    return ImageMetrics(*(getattr(found, field.name) for field in fields(ImageMetrics)))


def load(path: Union[str, os.PathLike[str]], *, overrides: Optional[Mapping[str, Any]] = None, frame: float = 0,
         camera: Union[None, str, os.PathLike[str]] = None, max_pixels: int = 0) -> Scene:
    """Reads a scene, mesh or glTF file. Raises SceneError if it cannot be read. The formats that assimp reads, such as FBX, need the program
    glint in PATH.

    overrides, frame: for YAML scenes, as in Scene. camera: the path of another scene, whose camera replaces the scene's. max_pixels: as in
    Scene.
    """
    options = _options(overrides, frame, max_pixels, None if camera is None else os.fsencode(camera))
    scene = Scene.__new__(Scene)
    scene._adopt(lambda handle, messages: _c.library.glint_scene_load(os.fsencode(path), ctypes.byref(options), handle, messages))
    return scene


def load_mesh(vertices: Any, faces: Any, normals: Any = None) -> Scene:
    """Makes a scene of gray triangles. A face's index is its object. A camera frames the mesh, and two lights illuminate it.

    vertices: (n, 3) finite numbers. faces: (m, 3) indices of vertices, with m from 1 to 16777216. normals: (n, 3) for smooth shading, or
    None; a normal of 0 means flat shading. Raises ValueError for other shapes, and SceneError for numbers and indices out of range.
    """
    points = _reals(vertices, 3, None, "vertices", np.float32 if getattr(vertices, "dtype", None) == np.float32 else np.float64)
    directions = None if normals is None else _reals(normals, 3, len(points), "normals", points.dtype)
    indices = np.asarray(faces)
    if indices.ndim != 2 or indices.shape[1] != 3 or not np.issubdtype(indices.dtype, np.integer):
        raise ValueError(f"faces: expected integers of shape (m, 3), not {indices.dtype} of shape {indices.shape}")
    if len(indices) and not 0 <= indices.min() <= indices.max() < len(points):
        wrong = indices.min() if indices.min() < 0 else indices.max()
        raise SceneError(f"faces: there is no vertex {wrong} of {len(points)}")
    triangles = np.ascontiguousarray(indices, np.uint32)
    mesh = _c.Mesh(ctypes.sizeof(_c.Mesh), 0 if points.dtype == np.float32 else 1, _h.pointer(points), _h.pointer(directions), len(points),
                   _h.pointer(triangles), len(triangles))
    scene = Scene.__new__(Scene)
    scene._adopt(lambda handle, messages: _c.library.glint_scene_of_mesh(ctypes.byref(mesh), handle, messages))
    return scene
