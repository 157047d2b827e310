// Affine transforms of meshes.
#pragma once

#include "host/import/mesh/mesh_import.h"

// Three rows of a matrix, the last column the translation.
typedef struct {
    double rows[3][4];
} Affine;

Affine affine_multiply(const Affine *a, const Affine *b);
Affine affine_of_transform(const MeshTransform *transform);
Vector3 affine_point(const Affine *affine, Vector3 p);
Vector3 affine_direction(const Affine *affine, Vector3 v);
double affine_determinant(const Affine *affine);
// Transforms normals: the transposed inverse times |determinant|.
Affine affine_for_normals(const Affine *affine);
