// Traces single rays through a scene with Embree (Debian package libembree-dev), for tools/peers/hard-cases.
//
// usage: PROGRAM robust|plain < SCENE
//
// Each line of SCENE is a word with numbers. `object` begins the next object, whose parts follow (sphere:
// center, radius; disc: center, normal, radius; triangle: three corners; cone: a point and its radius,
// twice). `ray` has an origin, a direction and the distance where it starts. Prints each ray's object and
// distance, or `-`.
#include <embree3/rtcore.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TRIANGLES_MAX = 1 << 15 };

static void numbers_read(float *numbers, int count)
{
    for (int i = 0; i < count; i++) {
        char word[64], *end;
        if (scanf("%63s", word) != 1) exit(1);
        numbers[i] = strtof(word, &end);
        if (*end != '\0') exit(1);
    }
}

static void buffer_fill(RTCGeometry geometry, enum RTCBufferType type, enum RTCFormat format,
                        const void *items, size_t size, size_t count)
{
    memcpy(rtcSetNewGeometryBuffer(geometry, type, 0, format, size, count), items, size * count);
}

static void geometry_attach(RTCScene scene, RTCGeometry geometry, uintptr_t object)
{
    rtcSetGeometryUserData(geometry, (void *)object);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
}

// Adds a sphere, a disc or a truncated cone, which have one or two points with radii.
static void round_add(RTCDevice device, RTCScene scene, enum RTCGeometryType type, const float *points,
                      size_t count, const float *normal, uintptr_t object)
{
    static const unsigned first = 0;
    RTCGeometry geometry = rtcNewGeometry(device, type);
    buffer_fill(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, points, 4 * sizeof(float), count);
    if (normal)
        buffer_fill(geometry, RTC_BUFFER_TYPE_NORMAL, RTC_FORMAT_FLOAT3, normal, 3 * sizeof(float), 1);
    if (count == 2) buffer_fill(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, &first, sizeof first, 1);
    geometry_attach(scene, geometry, object);
}

// The triangles of one object, as one mesh.
typedef struct {
    float vertices[3 * TRIANGLES_MAX][3];
    unsigned indices[TRIANGLES_MAX][3];
    unsigned vertex_count, triangle_count;
} Mesh;

// Returns the index of the vertex at this position, which neighbors share. Adds one if there is none.
static unsigned vertex_index(Mesh *mesh, const float *place)
{
    for (unsigned i = mesh->vertex_count; i-- > 0;)
        if (memcmp(mesh->vertices[i], place, sizeof mesh->vertices[i]) == 0) return i;
    memcpy(mesh->vertices[mesh->vertex_count], place, sizeof mesh->vertices[0]);
    return mesh->vertex_count++;
}

static void mesh_add(RTCDevice device, RTCScene scene, Mesh *mesh, uintptr_t object)
{
    if (mesh->triangle_count == 0) return;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    buffer_fill(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh->vertices, sizeof mesh->vertices[0],
                mesh->vertex_count);
    buffer_fill(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh->indices, sizeof mesh->indices[0],
                mesh->triangle_count);
    geometry_attach(scene, geometry, object);
    mesh->vertex_count = mesh->triangle_count = 0;
}

static void ray_answer(RTCScene scene, const float *ray)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit hit = {.ray = {.org_x = ray[0],
                                    .org_y = ray[1],
                                    .org_z = ray[2],
                                    .dir_x = ray[3],
                                    .dir_y = ray[4],
                                    .dir_z = ray[5],
                                    .tnear = ray[6],
                                    .tfar = INFINITY,
                                    .mask = ~0u},
                            .hit.geomID = RTC_INVALID_GEOMETRY_ID};
    rtcIntersect1(scene, &context, &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
        puts("-");
        return;
    }
    uintptr_t object = (uintptr_t)rtcGetGeometryUserData(rtcGetGeometry(scene, hit.hit.geomID));
    printf("%d %.9g\n", (int)object - 1, hit.ray.tfar);
}

int main(int argc, char **argv)
{
    if (argc != 2) return 1;
    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    if (strcmp(argv[1], "robust") == 0) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    static Mesh mesh;
    char word[16];
    uintptr_t object = 0; // its number, counted from 1
    int is_built = 0;
    while (scanf("%15s", word) == 1) {
        float numbers[9];
        if (strcmp(word, "object") == 0) {
            mesh_add(device, scene, &mesh, object);
            object++;
        } else if (strcmp(word, "sphere") == 0) {
            numbers_read(numbers, 4);
            round_add(device, scene, RTC_GEOMETRY_TYPE_SPHERE_POINT, numbers, 1, NULL, object);
        } else if (strcmp(word, "disc") == 0) {
            numbers_read(numbers, 7);
            float point[4] = {numbers[0], numbers[1], numbers[2], numbers[6]};
            round_add(device, scene, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT, point, 1, &numbers[3], object);
        } else if (strcmp(word, "cone") == 0) {
            numbers_read(numbers, 8);
            round_add(device, scene, RTC_GEOMETRY_TYPE_CONE_LINEAR_CURVE, numbers, 2, NULL, object);
        } else if (strcmp(word, "triangle") == 0) {
            numbers_read(numbers, 9);
            if (mesh.triangle_count == TRIANGLES_MAX) return 1;
            unsigned *corners = mesh.indices[mesh.triangle_count++];
            for (int i = 0; i < 3; i++)
                corners[i] = vertex_index(&mesh, &numbers[3 * i]);
        } else if (strcmp(word, "ray") == 0) {
            mesh_add(device, scene, &mesh, object);
            if (!is_built) rtcCommitScene(scene);
            is_built = 1;
            numbers_read(numbers, 7);
            ray_answer(scene, numbers);
        } else {
            return 1;
        }
    }
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    return 0;
}
