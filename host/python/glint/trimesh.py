"""A drop-in for trimesh.ray: mesh.ray = glint.trimesh.RayMeshIntersector(mesh)."""
from __future__ import annotations

from typing import Any, Optional

import numpy as np

from . import MISS, Hits, Selector, load_mesh


class RayMeshIntersector:
    """Ray queries on a trimesh.Trimesh, with the methods of trimesh.ray's classes.

    Queries for the first hit or any hit are traced at `precision`. At `certified`, `hits` reports which results are proven.
    Queries for all hits are traced in double and are not certified. If the mesh changes, create a new intersector.
    """

    def __init__(self, mesh: Any, *, precision: str = "certified", device: Selector = None):
        self.mesh = mesh
        self._precision, self._device = precision, device
        self._scene = load_mesh(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces))

    def hits(self, origins: Any, directions: Any) -> Hits:
        """Returns the nearest hits with their bounds and certainty."""
        return self._scene.trace(np.asarray(origins, np.float64), np.asarray(directions, np.float64),
                                 precision=self._precision, device=self._device)

    def intersects_first(self, ray_origins: Any, ray_directions: Any) -> np.ndarray:
        """Returns the index of the first triangle that each ray hits, -1 where it hits none."""
        found = self.hits(ray_origins, ray_directions)
        return np.where(found.hit, found.object.astype(np.int64), -1)

    def intersects_any(self, ray_origins: Any, ray_directions: Any) -> np.ndarray:
        """Returns whether each ray hits anything."""
        return self._scene.occluded(np.asarray(ray_origins, np.float64), np.asarray(ray_directions, np.float64),
                                    precision=self._precision, device=self._device)

    def intersects_location(self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True,
                            max_hits: Optional[int] = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the hit points (n, 3), the index of each point's ray, and the index of its triangle, of all hits or of the nearest
        `max_hits` of each ray."""
        triangles, rays, locations = self.intersects_id(ray_origins, ray_directions, multiple_hits, max_hits, return_locations=True)
        return locations, rays, triangles

    def intersects_id(self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True, max_hits: Optional[int] = 20,
                      return_locations: bool = False) -> tuple[np.ndarray, ...]:
        """Returns the triangles that rays hit and the indices of these rays, and with `return_locations` the hit points.
        A ray's hits are sorted by t. Only the nearest `max_hits` are returned, or all if it is None. If several triangles are hit at the
        same t, only the first is returned."""
        origins, directions = (np.asarray(array, np.float64) for array in (ray_origins, ray_directions))
        if multiple_hits:
            found = self._scene.trace_all(origins, directions, hits_max=max_hits, device=self._device)
            rays, objects, t = found.ray, found.object, found.t
        else:
            nearest = self.hits(origins, directions)
            rays, objects, t = np.flatnonzero(nearest.hit), nearest.object[nearest.hit], nearest.t[nearest.hit]
        result = objects.astype(np.int64), rays
        return (*result, origins[rays] + t[:, None] * directions[rays]) if return_locations else result

    def contains_points(self, points: Any) -> np.ndarray:
        """Returns whether each point lies inside the mesh, which must be watertight. Rays from inside points hit an odd number
        of triangles. Their direction avoids the edges of common models."""
        points = np.asarray(points, np.float64)
        directions = np.broadcast_to([0.4395064455, 0.617598629942, 0.652231566745], points.shape)
        found = self._scene.trace_all(points, directions, device=self._device)
        return np.bincount(found.ray, minlength=len(points)) % 2 == 1


__all__ = ["MISS", "RayMeshIntersector"]
