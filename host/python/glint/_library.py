"""Binds the C interface of libglint (glint.h) with ctypes."""
import ctypes
import importlib.util
import os
import pathlib
from ctypes import POINTER, c_char, c_char_p, c_double, c_int, c_size_t, c_uint32, c_uint64, c_void_p

NAME = "libglint.so.1"
Progress = ctypes.CFUNCTYPE(c_int, c_void_p, c_double)


def structure(name, *fields):
    return type(name, (ctypes.Structure,), {"_fields_": [("size", c_size_t), *fields]})


DeviceInfo = structure("DeviceInfo", ("index", c_uint32), ("compute_units", c_uint32), ("memory_bytes", c_uint64), ("is_gpu", c_int),
                       ("is_cpu", c_int), ("has_double", c_int), ("is_usable", c_int), ("name", c_char * 128),
                       ("platform", c_char * 128), ("driver", c_char * 64))
SceneOptions = structure("SceneOptions", ("overrides", POINTER(c_char_p)), ("override_count", c_size_t), ("frame", c_double), ("camera", c_char_p),
                         ("max_pixels", c_uint32))
Mesh = structure("Mesh", ("real", c_int), ("vertices", c_void_p), ("normals", c_void_p), ("vertex_count", c_size_t),
                 ("triangles", c_void_p), ("triangle_count", c_size_t))
RenderSettings = structure("RenderSettings", ("width", c_uint32), ("height", c_uint32), ("samples", c_uint32), ("bounces", c_uint32),
                           ("precision", c_int), ("lanes", c_uint32), ("progress", Progress), ("context", c_void_p),
                           ("min_contribution", c_double))
Image = structure("Image", *((name, c_void_p) for name in ("color", "t", "normal", "position", "object", "shadow", "flag", "coverage", "backdrop")))
TraceSettings = structure("TraceSettings", ("precision", c_int), ("lanes", c_uint32))
Rays = structure("Rays", ("count", c_size_t), ("real", c_int), ("origins", c_void_p), ("directions", c_void_p), ("tmin", c_void_p),
                 ("tmax", c_void_p))
AllHits = structure("AllHits", ("count", c_size_t), ("ray", POINTER(c_size_t)), ("object", POINTER(c_uint32)),
                    *((name, POINTER(c_double)) for name in ("t", "normal", "position")))
Hits = structure("Hits", *((name, c_void_p) for name in ("object", "t", "low", "high", "normal", "position", "certainty")))
Occlusion = structure("Occlusion", ("occluded", c_void_p), ("certainty", c_void_p))
ImagePair = structure("ImagePair", ("real", c_int), ("width", c_uint32), ("height", c_uint32), ("channels", c_uint32), ("reference", c_void_p),
                      ("image", c_void_p), ("is_data", c_int))
ImageMetrics = structure("ImageMetrics", *((name, c_uint64) for name in ("differing_values", "unmatched_values", "nonfinite_reference",
                                                                         "nonfinite_image", "compared_values")),
                         *((name, c_double) for name in ("max_abs", "rmse", "bias", "p99_9", "psnr", "rel_mse", "max_ulp")),
                         ("worst_x", c_uint32), ("worst_y", c_uint32), ("srgb8_off_by_1", c_uint64), ("srgb8_off_by_2_or_more", c_uint64),
                         *((name, c_double) for name in ("srgb8_psnr", "flip_mean", "flip_max")))

_MESSAGES = POINTER(c_void_p)
_FUNCTIONS = {
    "glint_version": (c_char_p,),
    "glint_text_free": (None, c_void_p),
    "glint_devices_list": (c_int, POINTER(DeviceInfo), c_size_t, POINTER(c_size_t), _MESSAGES),
    "glint_device_open": (c_int, c_char_p, POINTER(c_void_p), _MESSAGES),
    "glint_device_close": (None, c_void_p),
    "glint_scene_load": (c_int, c_char_p, POINTER(SceneOptions), POINTER(c_void_p), _MESSAGES),
    "glint_scene_parse": (c_int, c_char_p, c_size_t, c_char_p, POINTER(SceneOptions), POINTER(c_void_p), _MESSAGES),
    "glint_scene_of_mesh": (c_int, POINTER(Mesh), POINTER(c_void_p), _MESSAGES),
    "glint_scene_free": (None, c_void_p),
    "glint_scene_object_count": (c_size_t, c_void_p),
    "glint_scene_light_count": (c_size_t, c_void_p),
    "glint_scene_frame_count": (c_uint32, c_void_p),
    "glint_scene_image_size": (None, c_void_p, POINTER(c_uint32), POINTER(c_uint32)),
    "glint_render": (c_int, c_void_p, c_void_p, POINTER(RenderSettings), POINTER(Image), _MESSAGES),
    "glint_tracer_open": (c_int, c_void_p, c_void_p, POINTER(TraceSettings), POINTER(c_void_p), _MESSAGES),
    "glint_tracer_close": (None, c_void_p),
    "glint_trace": (c_int, c_void_p, POINTER(Rays), POINTER(Hits), _MESSAGES),
    "glint_trace_occlusion": (c_int, c_void_p, POINTER(Rays), POINTER(Occlusion), _MESSAGES),
    "glint_trace_all": (c_int, c_void_p, POINTER(Rays), c_size_t, POINTER(AllHits), _MESSAGES),
    "glint_all_hits_free": (None, POINTER(AllHits)),
    "glint_images_compare": (c_int, POINTER(ImagePair), POINTER(ImageMetrics), _MESSAGES),
}


def pocl_of_pip(vendors="/etc/OpenCL/vendors"):
    """Returns the PoCL library of pip's pocl-binary-distribution, or None if it is not installed or the system has a driver."""
    package = importlib.util.find_spec("pocl_binary_distribution")
    if not package or not package.origin or any(pathlib.Path(vendors).glob("*.icd")):
        return None
    libraries = pathlib.Path(package.origin).parents[1].glob("pyopencl/.libs/libpocl*.so")
    return next(map(str, libraries), None)


def _open():
    """Loads the library that GLINT_LIBRARY names, else the wheel's, else the system's. Sets environment variables to pip's PoCL."""
    bundled = pathlib.Path(__file__).with_name(NAME)
    driver = pocl_of_pip()
    if driver and "OCL_ICD_VENDORS" not in os.environ:
        os.environ["OCL_ICD_VENDORS"] = driver  # ocl-icd accepts a library's path
        os.environ.setdefault("OCL_ICD_FILENAMES", driver)  # the variable of Khronos' loader
    opened = ctypes.CDLL(os.environ.get("GLINT_LIBRARY") or (str(bundled) if bundled.exists() else NAME))
    for name, (result, *arguments) in _FUNCTIONS.items():
        function = getattr(opened, name)
        function.restype, function.argtypes = result, arguments
    return opened


library = _open()
