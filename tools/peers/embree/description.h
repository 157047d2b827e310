// A scene as tools/peers/embree.py writes it: lists of numbers, each after its name and how many items it
// has.
#pragma once

#include <stddef.h>

typedef struct {
    float x, y, z;
} Vector;

typedef struct {
    Vector eye, forward, right, up; // the last three unit and perpendicular
    float half_tangent;             // of the vertical field of view
} Camera;

typedef struct {
    Vector position, color;
} Light;

typedef struct {
    Vector ambient, diffuse; // the ambient light and the material's color are in them
    float specular, shininess;
} Material;

typedef struct {
    Vector point, normal; // the normal is unit
    int material;
} Plane;

typedef struct {
    Vector center;
    float radius;
} Sphere;

typedef struct {
    Vector *vertices, *normals; // one normal a vertex
    int (*faces)[3];
    size_t vertex_count, face_count;
    int material;
} Mesh;

typedef struct {
    Camera camera;
    Vector background;
    Light *lights;
    Material *materials;
    Plane *planes;
    Sphere *spheres;
    int *sphere_materials;
    Mesh *meshes;
    size_t light_count, material_count, plane_count, sphere_count, mesh_count;
} Description;

// Ends the program with a message where the file cannot be read or is no description. What it gives is held
// to the end of the program.
Description description_read(const char *path);

// Zeroed and aligned for any vector; ends the program where there is no memory.
void *memory_get(size_t count, size_t size);
