"""Calls the functions of libglint, and owns its devices, scenes and tracers."""
from __future__ import annotations

import contextlib
import ctypes
import operator
import sys
import threading
import warnings
import weakref
from typing import Any, Callable, Iterator, Optional, Union

import numpy as np

from . import _library as _c


class SceneError(ValueError):
    """Raised if a scene, file, setting or selector is wrong, with the messages that `glint` prints."""


class DeviceError(RuntimeError):
    """Raised if an OpenCL call failed."""


class Stopped(Exception):
    """Raised if the progress function returned True."""


class GlintWarning(UserWarning):
    """Warns of a part of a scene, a file or a cache that is not used, or not as its author may expect."""


_EXCEPTIONS = {1: SceneError, 2: DeviceError, 3: Stopped}  # by GlintStatus


def call(function: Any, *arguments: Any) -> None:
    """Calls a function of the library, whose last parameter is `messages`. Raises an exception for its status, or warns the first caller
    outside of the package."""
    messages = ctypes.c_void_p()
    status = function(*arguments, ctypes.byref(messages))
    text = ctypes.string_at(messages).decode("utf-8", "replace").rstrip() if messages else ""
    _c.library.glint_text_free(messages)
    if status:
        raise _EXCEPTIONS[status](text)
    if text:
        frame, level = sys._getframe(), 1
        while frame.f_back and str(frame.f_globals.get("__name__")).partition(".")[0] in (__package__, contextlib.__name__):
            frame, level = frame.f_back, level + 1
        warnings.warn(text, GlintWarning, stacklevel=level)


class Handle:
    """A device, scene or tracer of the library, which is closed once nothing refers to it, and not at exit, while other threads may still
    use it. It is an argument of ctypes.

    make: a function that sets the handle and the messages and returns a status. close: the function that closes the handle.
    needed: the handles that must be closed after this one.
    """

    def __init__(self, make: Callable[[Any, Any], int], close: Callable[[Any], None], *needed: "Handle"):
        self._as_parameter_ = ctypes.c_void_p()
        weakref.finalize(self, _handle_close, close, self._as_parameter_, needed).atexit = False
        call(make, ctypes.byref(self._as_parameter_))


# not a method, because it must not refer to the handle's object
def _handle_close(close: Callable[[Any], None], handle: ctypes.c_void_p, _needed: tuple[Handle, ...]) -> None:
    close(handle)


def pointer(array: Optional[np.ndarray]) -> Optional[int]:
    """Returns the address of the array's contents, which the caller keeps alive."""
    return None if array is None else array.ctypes.data


def uint32(name: str, value: int) -> int:
    """Returns the value. Raises ValueError unless it is an integer of 32 bits, because ctypes would truncate it silently."""
    try:
        value = operator.index(value)
    except TypeError:
        raise ValueError(f"{name}: expected an integer, not {value!r}") from None
    if not 0 <= value < 1 << 32:
        raise ValueError(f"{name}: expected 0 to {(1 << 32) - 1}, not {value}")
    return value


Selector = Union[None, int, str]  #: selects a device as `glint render --device` does; None selects the default
_opened: dict[Optional[str], Handle] = {}  # the open devices by selector
_opened_lock = threading.RLock()  # a function that shows warnings may use a device
_users: weakref.WeakSet[Any] = weakref.WeakSet()  # guarded by the lock


def device_users_add(user: Any) -> None:
    """Adds an object whose `_device_forget` is called with each device that fails."""
    with _opened_lock:
        _users.add(user)


# a function, so that the exception's traceback does not keep the users alive
def _device_forget(device: Handle) -> None:
    with _opened_lock:
        users = list(_users)
    for user in users:
        user._device_forget(device)


@contextlib.contextmanager
def device_opened(selector: Selector) -> Iterator[Handle]:
    """Yields a device. It stays open until the process exits, because its compiler is slow to start, or until it fails. The next use
    re-opens it then."""
    key = None if selector is None else str(selector)
    with _opened_lock:
        if key not in _opened:
            encoded = None if key is None else key.encode()
            _opened[key] = Handle(lambda handle, messages: _c.library.glint_device_open(encoded, handle, messages),
                                  _c.library.glint_device_close)
        device = _opened[key]
    try:
        yield device
    except DeviceError:
        with _opened_lock:
            if _opened.get(key) is device:
                del _opened[key]
        _device_forget(device)
        raise
