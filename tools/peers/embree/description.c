#include "description.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

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

typedef struct {
    const char *path;
    FILE *stream;
    uint64_t bytes_left;
} DescriptionFile;

static DescriptionFile file_open(const char *path)
{
    struct stat status;
    FILE *stream = fopen(path, "rb");
    if (!stream || fstat(fileno(stream), &status) != 0) {
        perror(path);
        exit(1);
    }
    return (DescriptionFile){path, stream, (uint64_t)status.st_size};
}

static void require(bool condition, const DescriptionFile *file, const char *otherwise)
{
    if (condition) return;
    fprintf(stderr, "%s: the description %s\n", file->path, otherwise);
    exit(1);
}

// Reads an array, which follows its number of items.
static void *array_read(DescriptionFile *file, size_t size, size_t *count)
{
    uint64_t found = 0;
    const bool has_count = fread(&found, sizeof found, 1, file->stream) == 1;
    require(has_count && file->bytes_left - sizeof found >= found * size && found <= file->bytes_left / size,
            file, "ends early");
    void *items = memory_get(found, size);
    require(fread(items, size, found, file->stream) == found, file, "cannot be read");
    file->bytes_left -= sizeof found + found * size;
    *count = found;
    return items;
}

static void *array_read_of(DescriptionFile *file, size_t size, size_t count)
{
    size_t found;
    void *items = array_read(file, size, &found);
    require(found == count, file, "has an array of another length than it must have");
    return items;
}

static Mesh mesh_read(DescriptionFile *file)
{
    Mesh mesh = {0};
    mesh.vertices = array_read(file, 3 * sizeof *mesh.vertices, &mesh.vertex_count);
    mesh.normals = array_read(file, 3 * sizeof *mesh.normals, &mesh.normal_count);
    require(mesh.normal_count == 0 || mesh.normal_count == mesh.vertex_count, file,
            "has a mesh with other normals than one for each vertex");
    mesh.faces = array_read(file, 3 * sizeof *mesh.faces, &mesh.face_count);
    mesh.instances = array_read(file, INSTANCE_PARTS * sizeof *mesh.instances, &mesh.instance_count);
    return mesh;
}

Description description_read(const char *path)
{
    DescriptionFile file = file_open(path);
    Description scene = {0};
    size_t count;
    scene.camera = array_read_of(&file, sizeof *scene.camera, 1);
    scene.lights = array_read(&file, sizeof *scene.lights, &scene.light_count);
    scene.materials = array_read(&file, MATERIAL_PARTS * sizeof *scene.materials, &count);
    scene.planes = array_read(&file, sizeof *scene.planes, &scene.plane_count);
    scene.plane_materials = array_read_of(&file, sizeof *scene.plane_materials, scene.plane_count);
    scene.spheres = array_read(&file, sizeof *scene.spheres, &scene.sphere_count);
    scene.sphere_materials = array_read_of(&file, sizeof *scene.sphere_materials, scene.sphere_count);
    scene.mesh_materials = array_read(&file, sizeof *scene.mesh_materials, &scene.mesh_count);
    scene.meshes = memory_get(scene.mesh_count, sizeof *scene.meshes);
    for (size_t i = 0; i < scene.mesh_count; i++) {
        scene.meshes[i] = mesh_read(&file);
        scene.meshes[i].first_instance = scene.instance_count;
        scene.instance_count += scene.meshes[i].instance_count;
    }
    require(file.bytes_left == 0, &file, "has more than the scene");
    fclose(file.stream);
    return scene;
}
