// glint certify compares a scene's image at each precision with the reference, on a sample of its pixels.
#include "host/verify/certify.h"
#include "host/base/clock.h"
#include "host/base/exit_status.h"
#include "host/base/json.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/format.h"
#include "host/cli/interrupts.h"
#include "host/cli/open_device.h"
#include "host/cli/passport_report.h"
#include "host/cli/report_json.h"
#include "host/compile/features.h"
#include <stdio.h>
#include <stdlib.h>

enum { PIXELS_DEFAULT = 2000, PIXELS_MOST = 1 << 24 };

static const ResultTable certify_table = {
    .command = "certify",
    .rows = "precisions",
    .names = {"scene", "size", "precision"},
    .values = {"pixels=compared", "wrong objects=wrong.object", "wrong shadows=wrong.shadow",
               "wrong paths=wrong.path", "wrong colors=wrong.color", "error of right colors=color.max_right",
               "error of wrong colors=color.max_wrong", "largest margin where wrong=wrong.margin",
               "wrong but certified=wrong_certified", "uncertified=uncertified.pixels", "verdict=claim"},
    .extras = {"reason"},
    .verdicts = {"claim"},
    .failed = "broken",
};

typedef struct {
    CommonOptions common;
    const char *scene;
    uint32_t pixels;
} CertifyOptions;

static const Option command_options[] = {{"pixels", "N", "compare about N pixels (default: 2000)",
                                          option_count, offsetof(CertifyOptions, pixels),
                                          NUMBERS(1, PIXELS_MOST)},
                                         PRECISIONS_OPTION("all that the scene and the device support")};

static const CommandLine command_line = {
    .command = "certify",
    .usage =
        "usage: glint certify SCENE [OPTIONS]\n\n"
        "Compares the image at each precision with a reference in quadruple precision, on a sample of its "
        "pixels:\nobjects, shadows, paths, colors. Exit status 3: certified is wrong at a pixel that it does "
        "not list as\nuncertified.\n",
    .groups = {OPTIONS(command_options), OPTIONS(size_option), OPTIONS(ray_options), SCENE_OPTIONS,
               OPTIONS(reference_option), OPTIONS(perturb_option), REPORT_OPTIONS},
    OPERANDS(SCENE, CertifyOptions, scene)};

typedef struct {
    bool measured;
    char *failure; // why a requested precision is not measured, or NULL
    CertifyErrors errors;
    CertifyUncertified uncertified; // only at `certified`
} CertifyRow;

typedef struct {
    const CertifyOptions *options;
    const Scene *scene;
    Compute *compute;
    CertifySample sample;
    size_t uncertain_count; // pixels that the reference leaves uncertain
    double reference_seconds;
    CertifyRow rows[PRECISION_COUNT];
} Certification;

static void certified_append(Text *notes, const CertifyErrors *errors, const CertifyUncertified *uncertified)
{
    text_appendf(notes,
                 "    colors are certified to %.2g of their largest channel, or of 1 if that is more\n",
                 CERTIFIED_COLOR_ERROR);
    if (errors->unconfirmed > 0)
        text_appendf(notes,
                     "    certified decides %zu pixel%s that the reference leaves uncertain, of which %zu "
                     "differ from it\n",
                     errors->unconfirmed, text_plural(errors->unconfirmed), errors->contradicted);
    if (uncertified->count == 0) return;
    text_appendf(
        notes,
        "    %zu pixel%s uncertified; of the %zu that were examined, %zu change if errors of 2^-50 are "
        "added, %zu lie within 2^-49 of a boundary, and %zu do neither\n",
        uncertified->count, text_plural(uncertified->count), uncertified->examined, uncertified->witnessed,
        uncertified->close, uncertified->examined - uncertified->witnessed - uncertified->close);
}

static void certify_notes(const void *context, size_t row, Text *notes)
{
    const Certification *certification = context;
    unsigned precision = 0;
    for (;; precision++) {
        const CertifyRow *at = &certification->rows[precision];
        if ((at->measured || at->failure) && row-- == 0) break;
    }
    const CertifyErrors *errors = &certification->rows[precision].errors;
    if (!certification->rows[precision].measured) return;
    text_appendf(notes, "    the largest error of color is at %u,%u\n", errors->worst[0], errors->worst[1]);
    if (precision == PRECISION_CERTIFIED)
        certified_append(notes, errors, &certification->rows[precision].uncertified);
}

static void heading_print(const Certification *certification)
{
    const CertifySample *sample = &certification->sample;
    size_t textured = 0;
    for (size_t i = 0; i < sample->count; i++)
        textured += sample->pixels[i].has_texture;
    device_heading_print(certification->compute->device, stdout);
    printf("%zu pixel%s, reference of %d bits in %.1f s", sample->count, text_plural(sample->count),
           (int)QUAD_BITS, certification->reference_seconds);
    if (certification->uncertain_count > 0)
        printf("; %zu that it leaves uncertain are not counted", certification->uncertain_count);
    if (textured > 0) printf("; the colors of %zu with a texture are not compared", textured);
    putchar('\n');
}

static void row_json(Json *json, Precision precision, const CertifyRow *row)
{
    const CertifyErrors *errors = &row->errors;
    const CertifyUncertified *uncertified = &row->uncertified;
    if (!row->measured && !row->failure) return;
    json_begin_object(json, NULL);
    json_text(json, "precision", precision_names[precision]);
    if (row->failure)
        unavailable_json(json, row->failure);
    else
        json_addf(json,
                  "compared %zu wrong {object %zu shadow %zu path %zu color %zu margin %g} "
                  "color {pixels %zu bound %g max_right %g max_wrong %g x %u y %u}",
                  errors->compared, errors->object, errors->shadow, errors->path, errors->color,
                  errors->margin, errors->colors, CERTIFIED_COLOR_ERROR, errors->right_color,
                  errors->wrong_color, errors->worst[0], errors->worst[1]);
    if (!row->failure && precision == PRECISION_CERTIFIED)
        json_addf(json,
                  "wrong_certified %zu claim %s unconfirmed %zu contradicted %zu "
                  "uncertified {pixels %zu examined %zu witnessed %zu close %zu}",
                  errors->violations, errors->violations > 0 ? "broken" : "kept", errors->unconfirmed,
                  errors->contradicted, uncertified->count, uncertified->examined, uncertified->witnessed,
                  uncertified->close);
    json_end(json);
}

static Json *certify_json(const Certification *certification)
{
    const CertifySample *sample = &certification->sample;
    const CommonOptions *common = &certification->options->common;
    Json *json = report_json_open(2, certification->compute->device);
    perturb_json(json, common->settings.perturb_seed, common->settings.perturb_scale);
    json_addf(
        json,
        "scene %s size [%u %u] bounces %u min_contribution %g pixels %zu reference_bits %u reference_ms %g "
        "reference_uncertain %zu",
        certification->options->scene, sample->width, sample->height, common->settings.bounce_count,
        common->settings.min_contribution, sample->count, (unsigned)QUAD_BITS,
        1e3 * certification->reference_seconds, certification->uncertain_count);
    json_begin_array(json, "precisions");
    for (unsigned i = 0; i < PRECISION_COUNT; i++)
        row_json(json, (Precision)i, &certification->rows[i]);
    json_end(json);
    return json;
}

// Renders at one precision and compares. Returns EXIT_DONE or the exit status of the failure. If the
// precision does not fit the device or the scene, prints an error if the user named it, and otherwise stores
// the reason in its row.
static int precision_compare(Certification *certification, RenderSettings settings, Precision precision)
{
    settings.precision = precision;
    CertifyRow *row = &certification->rows[precision];
    MessageList messages = {0};
    Renderer *renderer = renderer_open(certification->compute, certification->scene, &settings, &messages);
    const bool is_unfit = !renderer && message_count(&messages, MESSAGE_ERROR) > 0;
    if (is_unfit && !certification->options->common.precisions) {
        row->failure = memory_copy_text(message_first_error(&messages));
        message_list_free(&messages);
        return EXIT_DONE;
    }
    messages_print(&messages, NULL);
    const unsigned aovs = AOV_OBJECT | AOV_SHADOW | AOV_PATH | AOV_FLAG;
    Film film;
    const bool whole = renderer && renderer_render_film(renderer, aovs, &film);
    if (whole) {
        row->measured = true;
        row->errors = certify_compare(&certification->sample, &film);
        if (precision == PRECISION_CERTIFIED)
            row->uncertified = certify_uncertified(certification->scene, &film, &settings,
                                                   certification->options->pixels / 10 + 1);
        film_free(&film);
    }
    renderer_close(renderer);
    return is_unfit ? EXIT_USER : is_interrupted() ? EXIT_INTERRUPTED : whole ? EXIT_DONE : EXIT_MACHINE;
}

// Returns EXIT_CHECK with a message if `certified` violates its claim at a pixel.
static int violations_check(const CertifyErrors *certified)
{
    if (certified->violations == 0) return EXIT_DONE;
    stderr_print("certified is wrong at %zu pixel%s that it does not list as uncertified, most at %u,%u: "
                 "%.2g of the distance",
                 certified->violations, text_plural(certified->violations), certified->violation_place[0],
                 certified->violation_place[1], certified->violation_margin);
    return EXIT_CHECK;
}

// Returns the name of a feature of the scene that the exact reference does not support, or NULL.
static const char *unsupported_feature(const Scene *scene)
{
    enum { OBJECTS_MAX = 1 << 26 }; // of 168 bytes each
    const FeatureSet features = features_of(scene);
    if (scene_primitive_count(scene) > OBJECTS_MAX) return "more than 67,108,864 objects and triangles";
    if (features & FEATURE_CUTOUTS) return "cutouts";
    if (features & FEATURE_NORMAL_MAPS) return "normal maps";
    if (features & FEATURE_AREA_LIGHTS) return "area lights";
    if (features & FEATURE_LENS) return "a lens ('aperture')";
    return features & FEATURE_ORTHOGRAPHIC ? "parallel rays" : NULL;
}

static int scene_certify(const CertifyOptions *options, const Scene *scene, OpenDevice *open)
{
    const char *unsupported = unsupported_feature(scene);
    if (unsupported) {
        stderr_print(
            "the reference in quadruple precision does not support %s, so this scene cannot be certified",
            unsupported);
        return EXIT_USER;
    }
    Compute *compute = &open->compute;
    const bool is_certified =
        !options->common.precisions || options->common.precisions >> PRECISION_CERTIFIED & 1;
    if (is_certified && !reference_open(compute, &open->devices, options->common.reference_device))
        return EXIT_USER;
    Certification certification = {.options = options, .scene = scene, .compute = compute};
    const RenderSettings settings = settings_of_scene(&options->common, scene);
    const double start = clock_seconds();
    if (!certify_sample_open(&certification.sample, scene, &settings, options->pixels))
        return EXIT_INTERRUPTED;
    certification.reference_seconds = clock_seconds() - start;
    for (size_t i = 0; i < certification.sample.count; i++)
        certification.uncertain_count += reference_is_uncertain(&certification.sample.pixels[i]);
    int status = EXIT_DONE;
    for (unsigned i = 0; i < PRECISION_COUNT && status == EXIT_DONE; i++) {
        if (!options->common.precisions || options->common.precisions >> i & 1)
            status = precision_compare(&certification, settings, (Precision)i);
    }
    const ReportOptions *report = &options->common.report;
    if (status == EXIT_DONE && report_has_text(report)) heading_print(&certification);
    if (status == EXIT_DONE &&
        !report_output(certify_json(&certification), report, certify_notes, &certification))
        status = EXIT_USER;
    if (status == EXIT_DONE) status = violations_check(&certification.rows[PRECISION_CERTIFIED].errors);
    for (unsigned i = 0; i < PRECISION_COUNT; i++)
        free(certification.rows[i].failure);
    certify_sample_close(&certification.sample);
    return status;
}

int command_certify(int argument_count, char **arguments)
{
    CertifyOptions options = {.common.settings.bounce_count = BOUNCES_DEFAULT,
                              .common.report.table = &certify_table,
                              .pixels = PIXELS_DEFAULT};
    int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    Scene scene = {0};
    OpenDevice open;
    status = EXIT_USER;
    if (scene_open(&scene, options.scene, &options.common) && device_open(&open, &options.common)) {
        interrupts_flag();
        status = device_close(&open, scene_certify(&options, &scene, &open));
    }
    scene_free(&scene);
    return status;
}
