// Reads a scene as tools/peers/embree.py writes it, and has the vectors that it consists of.
#pragma once

#include <math.h>
#include <stddef.h>

typedef struct {
    float x, y, z;
} Vector;

typedef struct {
    Vector eye, forward, right, up; // the last three are unit and perpendicular
    float half_tangent;             // the tangent of half the vertical field of view
    Vector background;
} Camera;

typedef struct {
    Vector position, color; // a directional light's position is the direction to it
    float nearness;         // 1, or 0 for a directional light
} Light;

// Arrays are flat here and in meshes, because compilers gather only from flat arrays.
enum {
    MATERIAL_AMBIENT = 0, // a color, multiplied by the ambient light and the material's color
    MATERIAL_DIFFUSE = 3, // a color
    MATERIAL_SPECULAR = 6,
    MATERIAL_SHININESS = 7,
    MATERIAL_PARTS = 8
};

typedef struct {
    Vector point, normal; // the normal is unit
} Plane;

typedef struct {
    Vector center;
    float radius;
} Sphere;

enum { INSTANCE_PARTS = 12 }; // the columns of a matrix 3x4: a rotation times a factor, and a translation

typedef struct {
    float *vertices, *normals; // three numbers each; without normals, flat
    int *faces;                // three vertices each
    float *instances;          // INSTANCE_PARTS each; replace the mesh itself
    size_t vertex_count, normal_count, face_count, instance_count;
    size_t first_instance; // number of instances of earlier meshes
} Mesh;

typedef struct {
    Camera *camera;
    Light *lights;
    float *materials; // MATERIAL_PARTS each
    Plane *planes;
    Sphere *spheres;
    Mesh *meshes;
    int *plane_materials, *sphere_materials, *mesh_materials;
    size_t light_count, plane_count, sphere_count, mesh_count, instance_count;
} Description;

// Reads a description, which lives until the program exits. Exits with a message if the file cannot be read.
Description description_read(const char *path);

// Allocates zeroed memory, aligned for any vector. Exits if there is none.
void *memory_get(size_t count, size_t size);

static inline Vector vector_add(Vector a, Vector b)
{
    return (Vector){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline Vector vector_scale(float factor, Vector a)
{
    return (Vector){factor * a.x, factor * a.y, factor * a.z};
}

static inline Vector vector_subtract(Vector a, Vector b)
{
    return vector_add(a, vector_scale(-1, b));
}

static inline float vector_dot(Vector a, Vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline Vector vector_unit(Vector a)
{
    return vector_scale(1 / sqrtf(vector_dot(a, a)), a);
}

// Returns three consecutive numbers of a flat array.
static inline Vector vector_at(const float *numbers, int first)
{
    return (Vector){numbers[first], numbers[first + 1], numbers[first + 2]};
}
