// Renders the scene that tools/peers/embree.py wrote with Embree on all cores. Prints the times of building
// and of frames as JSON, and writes the image.
#include "packet.h"
#include "spheres.h"

#include "host/render/sample_pattern.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <xmmintrin.h>

// --incoherent omits Embree's flag for coherent rays, --user-spheres tests spheres in a callback, and
// --seconds is the time after which no frame begins, but at least 5 are rendered.
static const char usage[] =
    "usage: embree DESCRIPTION [--single | --user-spheres] [--incoherent] [--quality medium|high]\n"
    "              [--size WxH] [--samples N] [--seconds MAX] [-o IMAGE.ppm]\n";

enum { TILE = 32 }; // pixels along the side of a thread's share of work

typedef struct {
    const char *description, *output;
    bool one_by_one, incoherent, user_spheres;
    enum RTCBuildQuality quality;
    unsigned width, height, samples;
    double seconds;
} Options;

static double clock_read(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void embree_report(void *user, enum RTCError error, const char *text)
{
    (void)user;
    fprintf(stderr, "Embree error %d: %s\n", (int)error, text);
    exit(2);
}

static void geometry_attach(RTCScene scene, RTCGeometry geometry, unsigned id, enum RTCBuildQuality quality)
{
    rtcSetGeometryBuildQuality(geometry, quality);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
}

// Copies items into a buffer that Embree owns, because it needs padding after the data.
static void buffer_copy(RTCGeometry geometry, enum RTCBufferType type, enum RTCFormat format,
                        const void *items, size_t size, size_t count)
{
    memcpy(rtcSetNewGeometryBuffer(geometry, type, 0, format, size, count), items, size * count);
}

static RTCScene scene_create(RTCDevice device, enum RTCBuildQuality quality)
{
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, quality);
    return scene;
}

static void mesh_attach(RTCDevice device, RTCScene scene, const Description *description, size_t k,
                        enum RTCBuildQuality quality)
{
    const Mesh *mesh = &description->meshes[k];
    RTCGeometry triangles = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    buffer_copy(triangles, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh->vertices,
                3 * sizeof *mesh->vertices, mesh->vertex_count);
    buffer_copy(triangles, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh->faces, 3 * sizeof *mesh->faces,
                mesh->face_count);
    if (mesh->instance_count == 0) {
        geometry_attach(scene, triangles, mesh_geometry(description, k), quality);
        return;
    }
    RTCScene shared = scene_create(device, quality);
    geometry_attach(shared, triangles, mesh_geometry(description, k), quality);
    rtcCommitScene(shared);
    for (size_t i = 0; i < mesh->instance_count; i++) {
        RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, shared);
        rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR,
                                mesh->instances + INSTANCE_PARTS * i);
        geometry_attach(scene, instance, instance_geometry(description, mesh, i), quality);
    }
    rtcReleaseScene(shared);
}

static RTCScene scene_build(RTCDevice device, const Description *description, const Options *options)
{
    const enum RTCBuildQuality quality = options->quality;
    RTCScene scene = scene_create(device, quality);
    if (description->sphere_count > 0) {
        RTCGeometry geometry = (options->user_spheres ? spheres_user : spheres_embree)(
            device, description->spheres, description->sphere_count);
        geometry_attach(scene, geometry, 0, quality);
    }
    for (size_t k = 0; k < description->mesh_count; k++)
        mesh_attach(device, scene, description, k, quality);
    rtcCommitScene(scene);
    return scene;
}

// Sets the modes that Embree recommends for each thread that calls it.
static void denormals_off(void)
{
    const unsigned flush_to_zero = 0x8000, denormals_are_zero = 0x0040;
    _mm_setcsr(_mm_getcsr() | flush_to_zero | denormals_are_zero);
}

static void tile_render(const Renderer *renderer, unsigned left, unsigned top)
{
    for (unsigned y = top; y < top + TILE && y < renderer->height; y += PACKET_SIDE)
        for (unsigned x = left; x < left + TILE && x < renderer->width; x += PACKET_SIDE)
            packet_render(renderer, x, y);
}

static double frame_render(const Renderer *renderer)
{
    double start = clock_read(CLOCK_MONOTONIC);
    const unsigned columns = (renderer->width + TILE - 1) / TILE, rows = (renderer->height + TILE - 1) / TILE;
#pragma omp parallel
    {
        denormals_off();
#pragma omp for schedule(dynamic)
        for (unsigned tile = 0; tile < columns * rows; tile++)
            tile_render(renderer, tile % columns * TILE, tile / columns * TILE);
    }
    return clock_read(CLOCK_MONOTONIC) - start;
}

// Measures the seconds of each frame, and the average processor seconds of a frame, excluding the first two
// frames, which warm the caches.
static size_t frames_measure(const Renderer *renderer, double seconds, double *times, size_t limit,
                             double *processor_seconds)
{
    frame_render(renderer);
    frame_render(renderer);
    double start = clock_read(CLOCK_MONOTONIC), used = clock_read(CLOCK_PROCESS_CPUTIME_ID);
    size_t count = 0;
    while (count < limit && (count < 5 || clock_read(CLOCK_MONOTONIC) - start < seconds))
        times[count++] = frame_render(renderer);
    *processor_seconds = (clock_read(CLOCK_PROCESS_CPUTIME_ID) - used) / (double)count;
    return count;
}

static int compare_numbers(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void ppm_write(const Renderer *renderer, const char *path)
{
    FILE *file = fopen(path, "wb");
    if (file) {
        fprintf(file, "P6\n%u %u\n255\n", renderer->width, renderer->height);
        for (size_t i = 0; i < 3 * (size_t)renderer->width * renderer->height; i++)
            fputc((int)(255 * fminf(fmaxf(renderer->film[i], 0), 1) + 0.5F), file);
    }
    if (!file || ferror(file) || fclose(file) != 0) {
        perror(path);
        exit(1);
    }
}

// Reads a number from 1 to 65536 that `last` follows. Returns the text after that, or NULL on an error.
static const char *number_read(const char *text, char last, unsigned *number)
{
    char *end;
    unsigned long found = text && *text != '-' ? strtoul(text, &end, 10) : 0;
    *number = (unsigned)found;
    return found >= 1 && found <= 65536 && *end == last ? end + 1 : NULL;
}

static Options options_read(int count, char **words)
{
    static const struct option names[] = {
        {"single", no_argument, NULL, 's'},        {"incoherent", no_argument, NULL, 'i'},
        {"user-spheres", no_argument, NULL, 'u'},  {"quality", required_argument, NULL, 'q'},
        {"size", required_argument, NULL, 'w'},    {"seconds", required_argument, NULL, 'm'},
        {"samples", required_argument, NULL, 'n'}, {0}};
    Options options = {
        .quality = RTC_BUILD_QUALITY_HIGH, .width = 1920, .height = 1080, .samples = 1, .seconds = 2};
    bool is_sound = true;
    char *end;
    for (int letter; (letter = getopt_long(count, words, "o:", names, NULL)) != -1;) {
        if (letter == 's') options.one_by_one = true;
        if (letter == 'u') options.user_spheres = true;
        if (letter == 'i') options.incoherent = true;
        if (letter == 'q') {
            options.quality =
                strcmp(optarg, "medium") == 0 ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH;
            is_sound &= options.quality == RTC_BUILD_QUALITY_MEDIUM || strcmp(optarg, "high") == 0;
        }
        if (letter == 'w') {
            const char *height = number_read(optarg, 'x', &options.width);
            is_sound &= number_read(height, '\0', &options.height) != NULL;
        }
        if (letter == 'm') {
            options.seconds = strtod(optarg, &end);
            is_sound &= end != optarg && *end == '\0' && options.seconds >= 0;
        }
        if (letter == 'n') is_sound &= number_read(optarg, '\0', &options.samples) != NULL;
        if (letter == 'o') options.output = optarg;
        is_sound &= letter != '?';
    }
    is_sound &= !(options.one_by_one && options.user_spheres);
    if (!is_sound || optind != count - 1) {
        fputs(usage, stderr);
        exit(1);
    }
    options.description = words[optind];
    return options;
}

static void json_print(double build_seconds, double processor_seconds, double *times, size_t count)
{
    qsort(times, count, sizeof *times, compare_numbers);
    printf("{\"build_ms\": %.3f, \"processor_ms\": %.3f, \"frame_ms\": {\"min\": %.3f, \"median\": %.3f, "
           "\"max\": %.3f}}\n",
           1e3 * build_seconds, 1e3 * processor_seconds, 1e3 * times[0], 1e3 * times[count / 2],
           1e3 * times[count - 1]);
}

int main(int argument_count, char **arguments)
{
    Options options = options_read(argument_count, arguments);
    Description description = description_read(options.description);
    // In Debian 12, rtcOccluded16 of Embree 3.13.5 never returns for coherent packets and instances: its loop
    // over the remaining rays reads bits above the packet's 16.
    options.incoherent |= description.instance_count > 0;
    denormals_off();

    RTCDevice device = rtcNewDevice(NULL);
    if (!device) {
        fputs("Embree has no device here\n", stderr);
        return 2;
    }
    rtcSetDeviceErrorFunction(device, embree_report, NULL);
    double start = clock_read(CLOCK_MONOTONIC);
    RTCScene scene = scene_build(device, &description, &options);
    double build_seconds = clock_read(CLOCK_MONOTONIC) - start;

    Renderer renderer = {.description = &description,
                         .scene = scene,
                         .one_by_one = options.one_by_one,
                         .coherence = options.incoherent ? RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT
                                                         : RTC_INTERSECT_CONTEXT_FLAG_COHERENT,
                         .width = options.width,
                         .height = options.height,
                         .samples = options.samples,
                         .offsets = sample_pattern(options.samples, false),
                         .film = memory_get(3 * (size_t)options.width * options.height, sizeof(float))};
    static double times[10000];
    double processor_seconds;
    size_t count =
        frames_measure(&renderer, options.seconds, times, sizeof times / sizeof *times, &processor_seconds);
    json_print(build_seconds, processor_seconds, times, count);
    if (options.output) ppm_write(&renderer, options.output);
    return 0;
}
