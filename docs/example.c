// Renders a scene to a PPM file, prints the image's error and traces one ray along z:
//     cc example.c $(pkg-config --cflags --libs glint) -lm -o example
//     ./example scene.yaml image.ppm
#include <glint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

// Prints a call's warnings and errors; exits if it failed.
static void check(GlintStatus status, char **messages)
{
    if (*messages) fputs(*messages, stderr);
    glint_text_free(*messages);
    if (status != GLINT_DONE) exit(EXIT_FAILURE);
}

static int show_progress(void *context, double fraction_done)
{
    fprintf(context, "%3.0f%%\n", 100 * fraction_done);
    return 0;
}

enum { WIDTH = 320, HEIGHT = 180, VALUES = 3 * WIDTH * HEIGHT };

static void render(GlintDevice *device, const GlintScene *scene, GlintPrecision precision, double *color)
{
    char *messages;
    const GlintRenderSettings settings = {.size = sizeof settings,
                                          .width = WIDTH,
                                          .height = HEIGHT,
                                          .samples = 4,
                                          .bounces = 5,
                                          .precision = precision,
                                          .progress = show_progress,
                                          .context = stderr};
    GlintImage image = {.size = sizeof image, .color = color};
    check(glint_render(device, scene, &settings, &image, &messages), &messages);
}

// Prints how far an image in float is from one in double.
static void print_error(GlintDevice *device, const GlintScene *scene, const double *color)
{
    GlintDeviceInfo info = {.size = sizeof info};
    glint_device_info(device, &info);
    if (!info.has_double) return;
    char *messages;
    static double reference[VALUES];
    render(device, scene, GLINT_DOUBLE, reference);
    const GlintImagePair images = {.size = sizeof images,
                                   .real = GLINT_FLOAT64,
                                   .width = WIDTH,
                                   .height = HEIGHT,
                                   .channels = 3,
                                   .reference = reference,
                                   .image = color};
    GlintImageMetrics metrics = {.size = sizeof metrics};
    check(glint_images_compare(&images, &metrics, &messages), &messages);
    printf("RMSE %.1e, mean FLIP %.1e\n", metrics.rmse, metrics.flip_mean);
}

// Returns the sRGB value of a linear one.
static unsigned char encode(double light)
{
    const double clamped = fmin(fmax(light, 0), 1);
    return (unsigned char)lround(
        255 * (clamped <= 0.0031308 ? 12.92 * clamped : 1.055 * pow(clamped, 1 / 2.4) - 0.055));
}

// Returns 0, or -1 with errno if the file cannot be written.
static int write_image(const char *path, const double *color)
{
    FILE *file = fopen(path, "wb");
    if (!file) return -1;
    fprintf(file, "P6 %d %d 255\n", WIDTH, HEIGHT);
    for (size_t i = 0; i < VALUES && !ferror(file); i++)
        fputc(encode(color[i]), file);
    const int failed = ferror(file);
    return fclose(file) != 0 || failed ? -1 : 0;
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 3) return EXIT_FAILURE;
    char *messages;
    GlintDevice *device;
    GlintScene *scene;
    check(glint_device_open(NULL, &device, &messages), &messages);
    check(glint_scene_load(arguments[1], NULL, &scene, &messages), &messages);

    static double color[VALUES];
    render(device, scene, GLINT_SINGLE, color);
    print_error(device, scene, color);
    if (write_image(arguments[2], color) != 0) {
        perror(arguments[2]);
        return EXIT_FAILURE;
    }

    GlintTracer *tracer;
    const GlintTraceSettings precision = {.size = sizeof precision, .precision = GLINT_CERTIFIED};
    check(glint_tracer_open(device, scene, &precision, &tracer, &messages), &messages);
    const double origin[3] = {0, 1, -6}, direction[3] = {0, 0, 1}, tmax = 3.5;
    GlintRays rays = {
        .size = sizeof rays, .count = 1, .real = GLINT_FLOAT64, .origins = origin, .directions = direction};
    uint32_t object;
    double low, high;
    uint8_t certainty;
    GlintHits hits = {
        .size = sizeof hits, .object = &object, .low = &low, .high = &high, .certainty = &certainty};
    check(glint_trace(tracer, &rays, &hits, &messages), &messages);
    printf("object %u, t from %.9g to %.9g, %s\n", object, low, high,
           certainty == GLINT_UNCERTAIN ? "uncertain" : "certain");
    rays.tmax = &tmax;
    uint8_t is_occluded;
    GlintOcclusion occlusion = {.size = sizeof occlusion, .occluded = &is_occluded};
    check(glint_trace_occlusion(tracer, &rays, &occlusion, &messages), &messages);
    printf("%s before t = %g\n", is_occluded ? "something" : "nothing", tmax);

    glint_tracer_close(tracer);
    glint_scene_free(scene);
    glint_device_close(device);
    return EXIT_SUCCESS;
}
