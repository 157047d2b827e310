// Joins the vertices of meshes and makes meshes smooth.
#pragma once

#include "host/scene/scene.h"

void mesh_free(Mesh *mesh); // frees and zeroes

// Merges vertices with equal positions, normals and texture coordinates (0 equals -0), and removes vertices
// that no triangle uses.
void mesh_join_vertices(Mesh *mesh);

// Sets each vertex normal to the mean of the triangles around it, weighted by angle, or to zero if none of
// them has an area.
void mesh_make_normals(Mesh *mesh);

// A triangle of an object that is a mesh, in world coordinates.
typedef struct {
    Vector3 vertices[3], normals[3]; // the normals are set only if the mesh has some
} MeshTriangle;

MeshTriangle mesh_triangle_at(const Mesh *mesh, const Object *object, size_t part);
// Returns the materials of the object's triangles, or NULL if all triangles have the object's material.
const uint32_t *mesh_materials(const Mesh *mesh, const Object *object);
// Returns the bounds of the vertices.
Bounds mesh_vertex_bounds(const Mesh *mesh);
// Returns a box around the object. For an instance it encloses the transformed box of the mesh.
Bounds mesh_object_bounds(const Mesh *mesh, const Object *object);

// Returns how many triangles have no area.
size_t mesh_degenerate_count(const Mesh *mesh);
