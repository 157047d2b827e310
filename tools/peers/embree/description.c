#include "description.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *memory_get(size_t count, size_t size)
{
    const size_t alignment = 64;
    size_t bytes = (count * size + alignment) / alignment * alignment;
    void *memory = aligned_alloc(alignment, bytes);
    if (!memory) {
        fprintf(stderr, "no memory for %zu bytes\n", bytes);
        exit(1);
    }
    return memset(memory, 0, bytes);
}

// Reads an array, which follows its number of items.
static void *array_read(FILE *file, size_t size, size_t *count)
{
    uint64_t found;
    if (fread(&found, sizeof found, 1, file) == 1) {
        void *items = memory_get(found, size);
        *count = found;
        if (fread(items, size, found, file) == found) return items;
    }
    fputs("the scene ends early\n", stderr);
    exit(1);
}

static Mesh mesh_read(FILE *file)
{
    Mesh mesh = {0};
    mesh.vertices = array_read(file, 3 * sizeof *mesh.vertices, &mesh.vertex_count);
    mesh.normals = array_read(file, 3 * sizeof *mesh.normals, &mesh.normal_count);
    mesh.faces = array_read(file, 3 * sizeof *mesh.faces, &mesh.face_count);
    mesh.instances = array_read(file, INSTANCE_PARTS * sizeof *mesh.instances, &mesh.instance_count);
    return mesh;
}

Description description_read(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file) {
        perror(path);
        exit(1);
    }
    Description scene = {0};
    size_t count;
    scene.camera = array_read(file, sizeof *scene.camera, &count);
    scene.lights = array_read(file, sizeof *scene.lights, &scene.light_count);
    scene.materials = array_read(file, MATERIAL_PARTS * sizeof *scene.materials, &count);
    scene.planes = array_read(file, sizeof *scene.planes, &scene.plane_count);
    scene.plane_materials = array_read(file, sizeof *scene.plane_materials, &count);
    scene.spheres = array_read(file, sizeof *scene.spheres, &scene.sphere_count);
    scene.sphere_materials = array_read(file, sizeof *scene.sphere_materials, &count);
    scene.mesh_materials = array_read(file, sizeof *scene.mesh_materials, &scene.mesh_count);
    scene.meshes = memory_get(scene.mesh_count, sizeof *scene.meshes);
    for (size_t i = 0; i < scene.mesh_count; i++) {
        scene.meshes[i] = mesh_read(file);
        scene.meshes[i].first_instance = scene.instance_count;
        scene.instance_count += scene.meshes[i].instance_count;
    }
    fclose(file);
    return scene;
}
