// Reads a scene as tools/peers/embree.py writes it: lists of numbers, each preceded by its name and its
// number of items.
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    float x, y, z;
} Vector;

typedef struct {
    Vector eye, forward, right, up; // the last three are unit and perpendicular
    float half_tangent;             // the tangent of half the vertical field of view
} Camera;

typedef struct {
    Vector position, color; // a directional light's position is the direction to it
    bool is_directional;
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
    int material;
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
    size_t vertex_count, face_count, instance_count;
    size_t first_instance; // number of instances of earlier meshes
    int material;
} Mesh;

typedef struct {
    Camera camera;
    Vector background;
    Light *lights;
    float *materials; // MATERIAL_PARTS each
    Plane *planes;
    Sphere *spheres;
    int *sphere_materials;
    Mesh *meshes;
    size_t light_count, material_count, plane_count, sphere_count, mesh_count, instance_count;
} Description;

// Reads a description, which lives until the program exits. Exits with a message if the file cannot be read
// or is not a description.
Description description_read(const char *path);

// Allocates zeroed memory, aligned for any vector. Exits if there is none.
void *memory_get(size_t count, size_t size);
