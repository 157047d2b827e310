#include "description.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const char *path;
    char *at;
} Reader;

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

static char *file_read(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file || fseek(file, 0, SEEK_END) != 0) {
        perror(path);
        exit(1);
    }
    long size = ftell(file);
    rewind(file);
    char *text = memory_get((size_t)size + 1, 1);
    if (fread(text, 1, (size_t)size, file) != (size_t)size) {
        perror(path);
        exit(1);
    }
    fclose(file);
    return text;
}

static _Noreturn void reader_fail(const Reader *reader, const char *expected)
{
    fprintf(stderr, "%s: '%.20s' where %s is expected\n", reader->path, reader->at, expected);
    exit(1);
}

static float read_number(Reader *reader)
{
    char *end;
    float number = strtof(reader->at, &end);
    if (end == reader->at) reader_fail(reader, "a number");
    reader->at = end;
    return number;
}

static void read_numbers(Reader *reader, size_t count, float *numbers)
{
    for (size_t i = 0; i < count; i++)
        numbers[i] = read_number(reader);
}

static int read_index(Reader *reader, size_t limit)
{
    char *end;
    unsigned long index = strtoul(reader->at, &end, 10);
    if (end == reader->at || index >= limit || index > INT_MAX) reader_fail(reader, "an index");
    reader->at = end;
    return (int)index;
}

static Vector read_vector(Reader *reader)
{
    float x = read_number(reader), y = read_number(reader), z = read_number(reader);
    return (Vector){x, y, z};
}

static size_t read_list(Reader *reader, const char *name)
{
    reader->at += strspn(reader->at, " \n");
    size_t length = strlen(name);
    if (strncmp(reader->at, name, length) != 0) reader_fail(reader, name);
    reader->at += length;
    return (size_t)read_index(reader, INT_MAX);
}

static Mesh read_mesh(Reader *reader, size_t material_count)
{
    Mesh mesh = {.vertex_count = read_list(reader, "vertices")};
    mesh.vertices = memory_get(3 * mesh.vertex_count, sizeof *mesh.vertices);
    read_numbers(reader, 3 * mesh.vertex_count, mesh.vertices);
    size_t normal_count = read_list(reader, "normals");
    if (normal_count > 0) {
        if (normal_count != mesh.vertex_count) reader_fail(reader, "a normal for each vertex");
        mesh.normals = memory_get(3 * normal_count, sizeof *mesh.normals);
        read_numbers(reader, 3 * normal_count, mesh.normals);
    }
    mesh.face_count = read_list(reader, "faces");
    mesh.faces = memory_get(3 * mesh.face_count, sizeof *mesh.faces);
    for (size_t i = 0; i < 3 * mesh.face_count; i++)
        mesh.faces[i] = read_index(reader, mesh.vertex_count);
    mesh.material = read_index(reader, material_count);
    mesh.instance_count = read_list(reader, "instances");
    mesh.instances = memory_get(INSTANCE_PARTS * mesh.instance_count, sizeof *mesh.instances);
    read_numbers(reader, INSTANCE_PARTS * mesh.instance_count, mesh.instances);
    return mesh;
}

Description description_read(const char *path)
{
    Reader reader = {path, file_read(path)};
    char *text = reader.at;
    Description scene = {0};
    if (read_list(&reader, "camera") != 1) reader_fail(&reader, "one camera");
    Camera *camera = &scene.camera;
    camera->eye = read_vector(&reader);
    camera->forward = read_vector(&reader);
    camera->right = read_vector(&reader);
    camera->up = read_vector(&reader);
    camera->half_tangent = read_number(&reader);
    scene.background = read_vector(&reader);

    scene.light_count = read_list(&reader, "lights");
    scene.lights = memory_get(scene.light_count, sizeof *scene.lights);
    for (size_t i = 0; i < scene.light_count; i++) {
        scene.lights[i].position = read_vector(&reader);
        scene.lights[i].color = read_vector(&reader);
        scene.lights[i].is_directional = read_index(&reader, 2);
    }
    scene.material_count = read_list(&reader, "materials");
    scene.materials = memory_get(MATERIAL_PARTS * scene.material_count, sizeof *scene.materials);
    read_numbers(&reader, MATERIAL_PARTS * scene.material_count, scene.materials);
    scene.plane_count = read_list(&reader, "planes");
    scene.planes = memory_get(scene.plane_count, sizeof *scene.planes);
    for (size_t i = 0; i < scene.plane_count; i++) {
        scene.planes[i].point = read_vector(&reader);
        scene.planes[i].normal = read_vector(&reader);
        scene.planes[i].material = read_index(&reader, scene.material_count);
    }
    scene.sphere_count = read_list(&reader, "spheres");
    scene.spheres = memory_get(scene.sphere_count, sizeof *scene.spheres);
    scene.sphere_materials = memory_get(scene.sphere_count, sizeof *scene.sphere_materials);
    for (size_t i = 0; i < scene.sphere_count; i++) {
        scene.spheres[i].center = read_vector(&reader);
        scene.spheres[i].radius = read_number(&reader);
        scene.sphere_materials[i] = read_index(&reader, scene.material_count);
    }
    scene.mesh_count = read_list(&reader, "meshes");
    scene.meshes = memory_get(scene.mesh_count, sizeof *scene.meshes);
    for (size_t i = 0; i < scene.mesh_count; i++) {
        scene.meshes[i] = read_mesh(&reader, scene.material_count);
        scene.meshes[i].first_instance = scene.instance_count;
        scene.instance_count += scene.meshes[i].instance_count;
    }
    free(text);
    return scene;
}
