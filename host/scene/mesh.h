// Meshes: their vertices joined and made smooth.
#pragma once

#include "host/scene/scene.h"

void mesh_free(Mesh *mesh); // and zeroes

// Vertices that agree in all their numbers become one, and those of no triangle go; 0 and -0 agree.
void mesh_join_vertices(Mesh *mesh);

// Gives the vertices normals: of the triangles around them, by angle. Zero where no triangle has an area.
void mesh_make_normals(Mesh *mesh);

// How many triangles have no area.
size_t mesh_degenerate_count(const Mesh *mesh);
