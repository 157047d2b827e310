// Renders a scene to a PPM file and traces one ray along z:
//     cc example.c $(pkg-config --cflags --libs glint) -o example
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
    fprintf(context, "%3.0f %%\n", 100 * fraction_done);
    return 0;
}

// Returns the sRGB value of a linear one.
static unsigned char encode(double light)
{
    const double clamped = fmin(fmax(light, 0), 1);
    return (unsigned char)lround(
        255 * (clamped <= 0.0031308 ? 12.92 * clamped : 1.055 * pow(clamped, 1 / 2.4) - 0.055));
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 3) return EXIT_FAILURE;
    char *messages;
    GlintDevice *device;
    GlintScene *scene;
    check(glint_device_open(NULL, &device, &messages), &messages);
    check(glint_scene_load(arguments[1], NULL, &scene, &messages), &messages);

    const uint32_t width = 320, height = 180;
    double *color = calloc(3 * (size_t)width * height, sizeof *color);
    const GlintRenderSettings settings = {.size = sizeof settings,
                                          .width = width,
                                          .height = height,
                                          .samples = 4,
                                          .bounces = 5,
                                          .progress = show_progress,
                                          .context = stderr};
    GlintImage image = {.size = sizeof image, .color = color};
    check(glint_render(device, scene, &settings, &image, &messages), &messages);
    FILE *file = fopen(arguments[2], "wb");
    if (!file) return EXIT_FAILURE;
    fprintf(file, "P6 %u %u 255\n", width, height);
    for (size_t i = 0; i < 3 * (size_t)width * height; i++)
        fputc(encode(color[i]), file);
    fclose(file);
    free(color);

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
