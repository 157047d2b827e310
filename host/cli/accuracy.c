// glint accuracy measures speed against error by precision, lanes, BVH choice and samples.
#include "host/base/exit_status.h"
#include "host/base/memory.h"
#include "host/base/output.h"
#include "host/cli/accuracy_page.h"
#include "host/cli/accuracy_report.h"
#include "host/cli/commands.h"
#include "host/cli/film_files.h"
#include "host/cli/open_device.h"
#include "host/cli/page.h"
#include "host/cli/variants.h"
#include "host/image/image.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    VariantOptions variants;
    CommandOperands scenes;
    const char *reference_path, *folder, *page_path;
    AccuracyBudgets budgets;
} AccuracyOptions;

static bool budgets_read(const Option *option, const char *value, void *options)
{
    AccuracyBudgets *budgets = &((AccuracyOptions *)options)->budgets;
    const OptionItems list = {budgets->limits, sizeof *budgets->limits, BUDGETS_MAX, &budgets->count};
    return option_list(option, value, option_number, list);
}

static const Option command_options[] = {
    {"reference", "FILE",
     "compare with the linear colors in FILE (.exr or .npy), which has the images' size or a multiple that "
     "is averaged (default: the image at double)",
     option_text, offsetof(AccuracyOptions, reference_path)},
    {"budget", "LIST",
     "report the fastest configuration within each of these errors (default: 1e-2,1e-4,1e-6)", budgets_read,
     0, NUMBERS_ABOVE(0, INFINITY)},
    {"save", "FOLDER", "write all compared arrays there, as .npy", option_text,
     offsetof(AccuracyOptions, folder), .effect = effect_folder},
    {"html", "FILE", "write a self-contained HTML report", option_named_file,
     offsetof(AccuracyOptions, page_path)},
    PRECISIONS_OPTION("the first three")};

static const char *options_check(void *accuracy_options)
{
    const AccuracyOptions *options = accuracy_options;
    if (options->reference_path && options->scenes.count > 1)
        return "--reference takes one scene, but several are given";
    return NULL;
}

static const CommandLine command_line = {
    .command = "accuracy",
    .usage = "usage: glint accuracy SCENE... [OPTIONS]\n\n"
             "Measures speed and error of scenes in every requested configuration. The reference takes the "
             "largest of --samples.\n",
    .groups = {OPTIONS(command_options), VARIANT_OPTIONS, OPTIONS(perturb_option), TIMED_REPORT_OPTIONS},
    OPERANDS(SCENES, AccuracyOptions, scenes),
    .check = options_check};

typedef struct {
    AccuracyOptions options;
    OpenDevice open;
    VariantSet set;
    Film reference; // of the current scene, or of the only scene if it is read from a file
    AccuracyScene *scenes;
    AccuracyReport report; // of these scenes
    OutputFile page;       // opened before measuring, so that a failure shows early
    MessageList messages;
} Accuracy;

// Returns the image's colors, with each square of factor x factor pixels averaged into one pixel.
static double *colors_shrunk(const Image *image, uint32_t factor)
{
    const size_t width = image->width / factor, height = image->height / factor;
    double *colors = memory_allocate_zeroed(width * height, 3 * sizeof *colors);
    for (size_t y = 0; y < height * factor; y++)
        for (size_t x = 0; x < width * factor; x++)
            for (size_t channel = 0; channel < 3; channel++)
                colors[3 * (y / factor * width + x / factor) + channel] +=
                    image_value(image, 3 * (y * image->width + x) + channel);
    const double share = 1 / ((double)factor * factor);
    for (size_t i = 0; i < 3 * width * height; i++)
        colors[i] *= share;
    return colors;
}

// Reads --reference, whose width and height may be a whole multiple of the images'. On failure adds a message
// and returns false.
static bool reference_read(Accuracy *accuracy)
{
    const char *path = accuracy->options.reference_path;
    const RenderSettings *settings = &accuracy->set.variants[0].settings;
    Image image;
    const ImageReadOptions reading = {.max_pixels = accuracy->options.variants.common.scene.max_pixels};
    if (!image_read(&image, path, &reading, &accuracy->messages)) return false;
    const char *fault = image.display ? "display values; it must hold linear light, as in an .exr or .npy"
                        : image.data || image.channels != 3 ? "no colors"
                                                            : NULL;
    if (fault) message_error(&accuracy->messages, "the reference '%s' holds %s", path, fault);
    const uint32_t factor = image.width / settings->width;
    const bool fits = factor > 0 && image.width % settings->width == 0 &&
                      image.height / factor == settings->height && image.height % factor == 0;
    if (!fault && !fits)
        message_error(&accuracy->messages,
                      "the reference '%s' has %ux%u pixels, which is not a multiple of the images' %ux%u",
                      path, image.width, image.height, settings->width, settings->height);
    if (!fault && fits)
        accuracy->reference = (Film){.width = settings->width,
                                     .height = settings->height,
                                     .is_double = true,
                                     .real_size = sizeof(double),
                                     .color = colors_shrunk(&image, factor)};
    image_free(&image);
    return !fault && fits;
}

// Renders the scene in double, unperturbed, with the most samples of any variant. Returns EXIT_DONE or the
// exit status of the failure.
static int reference_render(Accuracy *accuracy, AccuracyScene *scene, const Variant *variants)
{
    Compute *compute = &accuracy->open.compute;
    RenderSettings settings = variants[0].settings;
    settings.precision = PRECISION_DOUBLE;
    settings.lanes = 0;
    settings.bvh = BVH_AUTO;
    settings.perturb_seed = settings.perturb_scale = 0;
    for (size_t i = 0; i < scene->variant_count; i++)
        if (variants[i].settings.sample_count > settings.sample_count)
            settings.sample_count = variants[i].settings.sample_count;
    Renderer *renderer =
        renderer_open(compute_in_double(compute), variants[0].scene, &settings, &accuracy->messages);
    if (!renderer) return compute_check_reference(compute) ? EXIT_USER : EXIT_MACHINE;
    bool whole = renderer_render_film(renderer, ACCURACY_AOVS, &accuracy->reference);
    if (compute->reference) scene->reference.device = compute->reference->device->name;
    scene->reference.precision = precision_names[settings.precision];
    scene->reference.bvh = bvh_choice_names[settings.bvh];
    scene->reference.lanes = renderer_report(renderer)->lanes;
    scene->reference.samples = settings.sample_count;
    scene->reference.kernel_hash = renderer_report(renderer)->kernel_hash;
    renderer_close(renderer);
    compute_check_reference(compute);
    return whole ? EXIT_DONE : EXIT_INTERRUPTED;
}

static bool is_reference(const AccuracyScene *scene, const AccuracyVariant *variant)
{
    return !scene->reference.file && !scene->reference.device &&
           variant->samples == scene->reference.samples &&
           variant->row->kernel_hash == scene->reference.kernel_hash;
}

static bool film_keep(Accuracy *accuracy, size_t scene, const AccuracyVariant *variant, const Film *film)
{
    if (!accuracy->options.folder) return true;
    Text prefix = accuracy_saved_prefix(&accuracy->report, scene, variant);
    bool saved = film_save(film, text_c(&prefix), &accuracy->messages);
    text_free(&prefix);
    return saved;
}

static int variant_compare(Accuracy *accuracy, size_t scene_index, AccuracyVariant *compared,
                           const Variant *variant)
{
    AccuracyScene *scene = &accuracy->scenes[scene_index];
    if (!variant->renderer) {
        compared->status = ACCURACY_UNAVAILABLE;
        return EXIT_DONE;
    }
    Film film;
    if (!renderer_render_film(variant->renderer, ACCURACY_AOVS, &film)) return EXIT_INTERRUPTED;
    compared->image = film_narrow_color(&film);
    if (is_reference(scene, compared))
        compared->status = ACCURACY_REFERENCE;
    else
        accuracy_compare(&compared->errors, &accuracy->reference, &scene->edges, &film,
                         scene->display_values);
    bool saved = film_keep(accuracy, scene_index, compared, &film);
    film_free(&film);
    return saved ? EXIT_DONE : EXIT_USER;
}

// Compares the variants of one scene with its reference.
static int scene_compare(Accuracy *accuracy, size_t scene_index, const VariantSet *part, Progress *progress)
{
    AccuracyScene *scene = &accuracy->scenes[scene_index];
    const Variant *variants = part->variants;
    const double measured = variants_measured_fraction;
    int status = EXIT_DONE;
    if (!scene->reference.file) {
        progress_step(progress, variant_set_fraction(part, measured),
                      "rendering the reference for row %zu of %zu", part->rows_before + 1, part->row_count);
        status = reference_render(accuracy, scene, variants);
    }
    if (status != EXIT_DONE) return status;
    const Film *reference = &accuracy->reference;
    accuracy_count_unsound(reference, &scene->reference.nonfinite, &scene->reference.negative);
    accuracy_edges_find(&scene->edges, reference);
    scene->reference.image = film_narrow_color(reference);
    if (!film_keep(accuracy, scene_index, NULL, reference)) status = EXIT_USER;
    for (size_t i = 0; i < scene->variant_count && status == EXIT_DONE; i++) {
        const double done = measured + (1 - measured) * (double)i / (double)part->count;
        progress_step(progress, variant_set_fraction(part, done), "comparing row %zu of %zu",
                      part->rows_before + i + 1, part->row_count);
        status = variant_compare(accuracy, scene_index, &scene->variants[i], &variants[i]);
    }
    film_free(&accuracy->reference);
    if (status == EXIT_DONE) accuracy_classify(scene, &accuracy->options.budgets);
    return status;
}

// Measures and compares the variants of one scene, which begin at `first`. Scenes are measured one at a time,
// so that a slow scene takes no runs from others.
static int scene_run(Accuracy *accuracy, size_t scene_index, size_t first, Progress *progress)
{
    VariantSet part = variant_set_part(&accuracy->set, first, accuracy->scenes[scene_index].variant_count);
    const bool whole =
        variant_set_measure(&part, &accuracy->options.variants, &accuracy->open.compute, false, progress);
    const int status = whole ? scene_compare(accuracy, scene_index, &part, progress) : EXIT_INTERRUPTED;
    for (size_t i = 0; i < part.count; i++)
        variant_close(&part.variants[i]);
    return status;
}

// Sorts the variants into scenes, which the report describes.
static void scenes_prepare(Accuracy *accuracy)
{
    const VariantSet *set = &accuracy->set;
    const CommonOptions *common = &accuracy->options.variants.common;
    accuracy->scenes = memory_allocate_zeroed(set->scene_count, sizeof *accuracy->scenes);
    accuracy->report = (AccuracyReport){.device = accuracy->open.compute.device,
                                        .perturb_seed = common->settings.perturb_seed,
                                        .perturb_scale = common->settings.perturb_scale,
                                        .scenes = accuracy->scenes,
                                        .scene_count = set->scene_count,
                                        .folder = accuracy->options.folder};
    for (size_t i = 0; i < set->count; i++) {
        AccuracyScene *scene = &accuracy->scenes[set->variants[i].scene - set->scenes];
        if (!scene->variants) {
            const Scene *source = set->variants[i].scene;
            const RenderSettings *settings = &set->variants[i].settings;
            scene->path = set->rows[i].key.scene;
            scene->width = settings->width;
            scene->height = settings->height;
            scene->light_count = (uint32_t)source->lights.count;
            scene->bounce_count = settings->bounce_count;
            scene->display_values = source->color_meaning == COLORS_DISPLAY;
            scene->reference.file = accuracy->options.reference_path;
            scene->variants = memory_allocate_zeroed(set->count, sizeof *scene->variants);
        }
        scene->variants[scene->variant_count++] =
            (AccuracyVariant){.row = &set->rows[i], .samples = set->variants[i].settings.sample_count};
    }
}

static bool has_reference(Accuracy *accuracy)
{
    const AccuracyOptions *options = &accuracy->options;
    Compute *compute = &accuracy->open.compute;
    const char *selector = options->variants.common.reference_device;
    const bool is_certified = options->variants.common.precisions >> PRECISION_CERTIFIED & 1;
    if (options->reference_path && !is_certified) return true;
    if (!reference_open(compute, &accuracy->open.devices, selector)) return false;
    if (!compute_ok(compute)) return true; // device_close reports it
    // with a file, only the rows at certified are unavailable
    if (options->reference_path || compute_in_double(compute)->device->fp64) return true;
    return message_error(
        &accuracy->messages,
        "neither the device \"%s\" nor another one has 64-bit floating point for a reference: "
        "name a file with --reference%s",
        // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): device_open has set it
        compute->device->name, device_fp64_hint(compute->device));
}

static bool page_commit(Accuracy *accuracy)
{
    if (!accuracy->options.page_path) return true;
    Text page = {0};
    page_append(&page, "accuracy.html", accuracy_json(&accuracy->report),
                accuracy_page_extras(&accuracy->report));
    bool written = output_write(&accuracy->page, page.items, page.count, &accuracy->messages) &&
                   output_commit(&accuracy->page, &accuracy->messages);
    text_free(&page);
    return written;
}

static int accuracy_run(Accuracy *accuracy)
{
    VariantSet *set = &accuracy->set;
    const char *page_path = accuracy->options.page_path;
    if (!has_reference(accuracy) ||
        (page_path && !output_open(&accuracy->page, page_path, &accuracy->messages)))
        return EXIT_USER;
    Progress progress;
    progress_open(&progress, false);
    scenes_prepare(accuracy);
    int status = EXIT_DONE;
    for (size_t i = 0, first = 0; i < set->scene_count && status == EXIT_DONE; i++) {
        status = scene_run(accuracy, i, first, &progress);
        first += accuracy->scenes[i].variant_count;
    }
    progress_close(&progress);
    if (status != EXIT_DONE) return status;
    const AccuracyReport *report = &accuracy->report;
    const ReportOptions *options = &accuracy->options.variants.common.report;
    if (!accuracy_print(report, options) || !page_commit(accuracy)) return EXIT_USER;
    if (variant_set_any_measured(set)) return EXIT_DONE;
    stderr_print("no variant could be rendered");
    return EXIT_USER;
}

static void accuracy_close(Accuracy *accuracy)
{
    for (size_t i = 0; accuracy->scenes && i < accuracy->set.scene_count; i++)
        accuracy_scene_free(&accuracy->scenes[i]);
    free(accuracy->scenes);
    film_free(&accuracy->reference);
    output_abandon(&accuracy->page);
    variant_set_close(&accuracy->set);
    messages_print(&accuracy->messages, NULL);
}

int command_accuracy(int argument_count, char **arguments)
{
    Accuracy accuracy = {.options = {.variants = variant_options_default,
                                     .budgets = {.limits = {1e-2, 1e-4, 1e-6}, .count = 3}}};
    const AccuracyOptions *options = &accuracy.options;
    accuracy.options.variants.common.precisions = (1u << ARITHMETIC_COUNT) - 1;
    accuracy.options.variants.common.report.table = &accuracy_table;
    int status = command_line_read(&command_line, &accuracy.options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    status = EXIT_USER;
    bool opened = variant_set_open(&accuracy.set, &options->variants, 1, options->scenes.items,
                                   options->scenes.count) &&
                  (!options->reference_path || reference_read(&accuracy)) &&
                  device_open(&accuracy.open, &options->variants.common);
    if (opened) status = accuracy_run(&accuracy);
    accuracy_close(&accuracy);
    return opened ? device_close(&accuracy.open, status) : status;
}
