// glint trace reads explicit rays and writes their hits as CSV.
#include "host/base/array.h"
#include "host/base/exit_status.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/open_device.h"
#include "host/image/image.h"
#include "host/import/report.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    CommonOptions common;
    const char *scene, *rays, *output;
} TraceOptions;

static const Option command_options[] = {
    {"rays", "FILE",
     "one ray per line: ox oy oz dx dy dz [tmin tmax], decimal or C hexadecimal; - is standard input; # "
     "starts a comment",
     option_text, offsetof(TraceOptions, rays)},
    {"output", "FILE", "CSV file (default: standard output)", option_text, offsetof(TraceOptions, output),
     .letter = 'o'}};

static const char *options_check(void *trace_options)
{
    const TraceOptions *options = trace_options;
    if (!options->rays) return "no rays given; use --rays FILE";
    if (strcmp(options->scene, "-") == 0 && strcmp(options->rays, "-") == 0)
        return "the scene and the rays cannot both be read from standard input";
    if (image_format_of(options->output) != IMAGE_UNKNOWN)
        return "the output is CSV; its name must not end in that of an image or array, such as .png or .npy";
    return NULL;
}

static const CommandLine command_line = {
    .command = "trace",
    .usage =
        "usage: glint trace SCENE --rays FILE [OPTIONS]\n\n"
        "Writes object,t,nx,ny,nz per ray; an empty object is a miss. Scene and rays are not shifted to "
        "the eye;\n"
        "each number is rounded once to the precision. At certified, low,high,certainty follow: bounds of "
        "the exact t,\n"
        "and whether object and bounds are certain, certain in double, or uncertain.\n",
    .groups = {OPTIONS(command_options), OPTIONS(precision_option), SCENE_OPTIONS, OPTIONS(driver_options),
               OPTIONS(perturb_option)},
    OPERANDS(SCENE, TraceOptions, scene),
    .check = options_check};

typedef ARRAY_OF(TraceRay) RayList;

// Reads up to eight numbers of a line. Returns their count, or -1 if a word is not a number.
static int line_numbers(Report *report, size_t start, size_t end, double numbers[8])
{
    const Source *source = report->source;
    int count = 0;
    const char *at = source->bytes + start, *stop = source->bytes + end;
    for (;;) {
        while (at < stop && (*at == ' ' || *at == '\t' || *at == ',' || *at == '\r'))
            at++;
        if (at >= stop || *at == '#') return count;
        char *after;
        double number = strtod(at, &after);
        size_t offset = (size_t)(at - source->bytes);
        if (after == at || after > stop || isnan(number)) {
            report_error(report, offset, "expected a number");
            return -1;
        }
        if (count == 8) {
            report_error(report, offset, "expected 6 numbers or 8, found more");
            return -1;
        }
        numbers[count++] = number;
        at = after;
    }
}

static TraceRay ray_make(const double n[8], int count)
{
    return (TraceRay){{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, n[6], count == 8 ? n[7] : (double)INFINITY};
}

static bool rays_read(RayList *rays, const Source *source, const CommonOptions *common, MessageList *messages)
{
    Report report = report_open(source, messages);
    for (size_t start = 0; start < source->length && !report_is_full(&report);) {
        const char *newline = memchr(source->bytes + start, '\n', source->length - start);
        size_t end = newline ? (size_t)(newline - source->bytes) : source->length;
        double numbers[8] = {0};
        int count = line_numbers(&report, start, end, numbers);
        const TraceRay ray = ray_make(numbers, count);
        const char *fault = trace_ray_why_not(&ray, common->settings.precision);
        if (count > 0 && count != 6 && count != 8)
            report_error(&report, start, "expected ox oy oz dx dy dz [tmin tmax], 6 numbers or 8, found %d",
                         count);
        else if (count > 0 && fault)
            report_error(&report, start, "%s", fault);
        else if (count > 0 && ray.tmax <= ray.tmin)
            report_error(&report, start, "tmax must be above tmin, but %g is not above %g", ray.tmax,
                         ray.tmin);
        else if (count > 0)
            array_push(*rays, ray);
        start = end + 1;
    }
    return report_close(&report);
}

// Returns whether the text is a NumPy array.
static bool is_npy(const Text *text)
{
    return text->count >= 6 && memcmp(text->items, "\x93NUMPY", 6) == 0;
}

static bool rays_load(RayList *rays, const TraceOptions *options)
{
    PrintedMessages messages = {0};
    OwnedText text = {0};
    if (!text_read_file(&text, options->rays, &messages)) return false;
    if (is_npy(&text))
        return message_error(
            &messages,
            "'%s' is a NumPy array, but rays must be text with ox oy oz dx dy dz [tmin tmax] on each line",
            options->rays);
    const Source source = {options->rays, text_c(&text), text.count};
    return rays_read(rays, &source, &options->common, &messages);
}

static void hit_print(const TraceHit *hit, Precision precision, FILE *file)
{
    const int digits = precision < PRECISION_DOUBLE ? 9 : 17;
    const bool is_hit = hit->object != UINT32_MAX;
    if (is_hit)
        fprintf(file, "%u,%.*g,%.*g,%.*g,%.*g", hit->object, digits, hit->t, digits, hit->normal.x, digits,
                hit->normal.y, digits, hit->normal.z);
    else
        fputs(",,,,", file);
    if (precision == PRECISION_CERTIFIED) {
        static const char *const certainties[] = {"uncertain", "certain", "certain in double"};
        if (is_hit && hit->certainty != TRACE_UNCERTAIN)
            fprintf(file, ",%.17g,%.17g", hit->low, hit->high);
        else
            fputs(",,", file);
        fprintf(file, ",%s", certainties[hit->certainty]);
    }
    fputc('\n', file);
}

static bool hits_write(const TraceOptions *options, const TraceHit *hits, size_t count)
{
    PrintedMessages messages = {0};
    OutputFile output;
    if (!output_open(&output, options->output, &messages)) return false;
    const Precision precision = options->common.settings.precision;
    fprintf(output.file, "object,t,nx,ny,nz%s\n",
            precision == PRECISION_CERTIFIED ? ",low,high,certainty" : "");
    for (size_t i = 0; i < count; i++)
        hit_print(&hits[i], precision, output.file);
    return output_commit(&output, &messages);
}

static int rays_answer(const TraceOptions *options, const Scene *scene, const RayList *rays, Compute *compute)
{
    RenderSettings settings = settings_whole(&options->common, 1, 1);
    MessageList messages = {0};
    Renderer *renderer = renderer_open(compute, scene, &settings, &messages);
    messages_print(&messages, NULL);
    if (!renderer) return EXIT_USER;
    OWNED TraceRay *scaled = memory_allocate(rays->count + 1, sizeof *scaled);
    OWNED TraceHit *hits = memory_allocate(rays->count + 1, sizeof *hits);
    OWNED int *exponents = memory_allocate(rays->count + 1, sizeof *exponents);
    for (size_t i = 0; i < rays->count; i++)
        scaled[i] = trace_ray_scaled(rays->items[i], options->common.settings.precision, &exponents[i]);
    const bool traced = renderer_trace_closest(renderer, scaled, rays->count, hits);
    for (size_t i = 0; i < rays->count && traced; i++)
        trace_hit_unscale(&hits[i], exponents[i]);
    const bool written = traced && hits_write(options, hits, rays->count);
    const int status = written ? command_finish(EXIT_DONE) : EXIT_USER;
    renderer_close(renderer);
    return status;
}

int command_trace(int argument_count, char **arguments)
{
    TraceOptions options = {.common.settings.precision = PRECISION_SINGLE, .output = "-"};
    int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    OwnedScene scene = {0};
    RayList rays = {0};
    OpenDevice open;
    status = EXIT_USER;
    if (scene_open(&scene, options.scene, &options.common) &&
        !output_overwrites_scene(options.output, &scene, options.scene) && rays_load(&rays, &options) &&
        device_open(&open, &options.common)) {
        // renderer_open reports that no device works in double
        if (options.common.settings.precision == PRECISION_CERTIFIED)
            reference_open(&open.compute, &open.devices, NULL);
        status = rays_answer(&options, &scene, &rays, &open.compute);
        status = device_close(&open, status);
    }
    free(rays.items);
    return status;
}
