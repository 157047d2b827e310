// A scene as tools/peers/embree.py writes it: lists of numbers, each after its name and how many items it
// has.
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    float x, y, z;
} Vector;

typedef struct {
    Vector eye, forward, right, up; // the last three unit and perpendicular
    float half_tangent;             // of the vertical field of view
} Camera;

typedef struct {
    Vector position, color; // of a directional light the position is the direction to it
    bool is_directional;
} Light;

// Flat arrays, here and in a mesh: only from those do compilers gather.
enum {
    MATERIAL_AMBIENT = 0, // a color; the ambient light and the material's own color are in it
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
    float *vertices, *normals; // three numbers of each; no normals: flat
    int *faces;                // three vertices of each
    float *instances;          // INSTANCE_PARTS of each; if there are any, only they are drawn
    size_t vertex_count, face_count, instance_count;
    size_t first_instance; // number of instances of earlier meshes
    int material;
} Mesh;

typedef struct {
    Camera camera;
    Vector background;
    Light *lights;
    float *materials; // MATERIAL_PARTS of each
    Plane *planes;
    Sphere *spheres;
    int *sphere_materials;
    Mesh *meshes;
    size_t light_count, material_count, plane_count, sphere_count, mesh_count, instance_count;
} Description;

// Ends the program with a message if the file cannot be read or is not a description. The result lives until
// the end of the program.
Description description_read(const char *path);

// Zeroed and aligned for any vector; ends the program where there is no memory.
void *memory_get(size_t count, size_t size);
