#include "host/cli/image_output.h"

#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/band_values.h"
#include "host/cli/film_files.h"
#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

// The bands that are copied. With one, the renderer would wait for each band to be encoded.
enum { COPIES = 2 };

// A copy of a band, which a thread writes once the bands before it are written. Until the thread is joined,
// all members but the last two belong to it.
typedef struct {
    ImageOutput *output;
    MessageList *messages;
    Film band;
    BandScratch layers[LAYER_COUNT]; // the memory of the band's layers
    size_t number;                   // counts the bands
    bool failed;                     // whether this band or an earlier one could not be written
    pthread_t thread;
    bool has_thread;
} BandCopy;

struct ImageOutput {
    const ImageOutputOptions *options;
    ImageFormat format;
    ImageOrigin origin;
    bool opened;
    ImageWriter *writers[1 + LAYER_COUNT]; // of the open files: the image, and each AOV's
    BandValues values;
    double bytes; // the size of all files before compression

    // Separate threads write the bands, in turn. The writers, `values`, `failed` and `seconds` belong to the
    // thread whose turn it is, or to the caller when all are joined.
    BandCopy copies[COPIES];
    size_t band_count; // whose threads were started
    bool failed;
    double seconds;
    pthread_mutex_t mutex; // of written_count
    pthread_cond_t changed;
    size_t written_count; // bands

    RerenderCounts rerenders; // the sum over all bands so far
    // All bands, if the file records their counts before their pixels.
    ARRAY_OF(Film) kept;
};

ImageOutput *image_output_open(const ImageOutputOptions *options, const ImageOrigin *origin)
{
    ImageOutput *output = memory_allocate_zeroed(1, sizeof *output);
    *output = (ImageOutput){.options = options,
                            .format = image_output_is_stdout(options->path) ? options->stdout_format
                                                                            : image_format_of(options->path),
                            .origin = *origin,
                            .values.eye = origin->scene->camera.position};
    if (pthread_mutex_init(&output->mutex, NULL) != 0 || pthread_cond_init(&output->changed, NULL) != 0)
        fault("out of memory: mutex");
    return output;
}

static bool is_exr(const ImageOutput *output)
{
    return output->format == IMAGE_EXR;
}

// Returns whether all bands must be kept, because EXR's notes precede its pixels and report all counts.
static bool keeps_bands(const ImageOutput *output)
{
    return output->origin.settings->precision == PRECISION_CERTIFIED && is_exr(output);
}

// Returns whether the AOV is written. The shadow masks of a scene without lights are not.
static bool is_written(const ImageOutput *output, const Film *film, Layer layer)
{
    return (output->options->aovs >> layer & 1) && film_components(film, layer) > 0;
}

// Returns whether the AOV is a layer of the EXR. The color is its R, G and B.
static bool is_exr_layer(const ImageOutput *output, const Film *film, Layer layer)
{
    return is_exr(output) && layer != LAYER_COLOR && is_written(output, film, layer);
}

// Appends the names of a layer's channels: depth.Z; R, G and B for a color; X, Y and Z for a vector; a number
// for each light.
static void channel_names_append(Text *names, const Film *film, Layer layer)
{
    const char *name = layer_names[layer];
    const uint32_t count = film_components(film, layer);
    if (layer == LAYER_T)
        text_appendf(names, "depth.Z");
    else if (layer == LAYER_SHADOW)
        for (uint32_t i = 0; i < count; i++)
            text_appendf(names, "%s%s.%u", i > 0 ? "," : "", name, i);
    else if (layer == LAYER_COVERAGE)
        text_appendf(names, "%s.part", name);
    else if (layer == LAYER_BACKDROP)
        text_appendf(names, "%s.R,%s.G,%s.B", name, name, name);
    else if (count == 3)
        text_appendf(names, "%s.X,%s.Y,%s.Z", name, name, name);
    else
        text_appendf(names, "%s.id", name);
}

static bool image_open(ImageOutput *output, const Film *film, const ImageNote *notes, MessageList *messages)
{
    const RenderSettings *settings = output->origin.settings;
    ImageHeader header = film_layer_header(film, LAYER_COLOR);
    header.format = output->format;
    header.transfer = output->options->transfer;
    header.bits = output->options->bits;
    header.exposure = output->options->exposure;
    header.tone = output->options->tone;
    header.dither = output->options->dither;
    header.notes = notes;
    if (header.format != IMAGE_NPY) header.npy_type = 'f';
    header.full_width = settings->width;
    header.full_height = settings->height;
    header.left = settings->region_x;
    header.top = settings->region_y;
    ImageLayer layers[LAYER_COUNT + 1];
    Text names[LAYER_COUNT + 1] = {0};
    header.layers = layers;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (!is_exr_layer(output, film, layer)) continue;
        Text *text = &names[header.layer_count];
        channel_names_append(text, film, layer);
        const char type = layer_types[layer] == LAYER_TYPE_INTEGER ? 'u' : 'f';
        layers[header.layer_count++] = (ImageLayer){text_c(text), film_components(film, layer), type};
    }
    if (output->options->alpha) layers[header.layer_count++] = (ImageLayer){"A", 1, 'f'};
    output->writers[0] = image_writer_open(output->options->path, &header, messages);
    output->bytes = (double)image_bytes(&header);
    for (size_t i = 0; i < header.layer_count; i++)
        text_free(&names[i]);
    return output->writers[0] != NULL;
}

static bool files_open(ImageOutput *output, const Film *band, MessageList *messages)
{
    const RerenderCounts *counts = keeps_bands(output) ? &output->rerenders : NULL;
    ImageNotes notes = {0};
    image_notes_add_all(&notes, &output->origin, output->options, output->format, counts);
    Film film = *band;
    film.height = output->origin.settings->region_height;
    bool opened = image_open(output, &film, notes.items, messages);
    image_notes_free(&notes);

    if (opened && (output->options->aovs & AOV_SHADOW) && !is_written(output, &film, LAYER_SHADOW))
        message_warning(messages, "no shadow masks are written: the scene has no lights");
    for (Layer layer = 0; layer < LAYER_COUNT && opened; layer++) {
        if (!is_written(output, &film, layer) || is_exr(output)) continue;
        ImageHeader header = film_layer_header(&film, layer);
        if (layer == LAYER_POSITION) header.npy_type = 'd';
        OWNED char *path = image_output_aov_path(output->options, layer_names[layer]);
        output->writers[1 + layer] = image_writer_open(path, &header, messages);
        opened = output->writers[1 + layer] != NULL;
        output->bytes += (double)image_bytes(&header);
    }
    return opened;
}

static bool band_write(ImageOutput *output, const Film *band, MessageList *messages)
{
    BandValues *values = &output->values;
    const bool is_npy = output->format == IMAGE_NPY;
    const void *arrays[LAYER_COUNT + 2];
    size_t count = 0;
    arrays[count++] = output->options->alpha ? band_foreground(values, band, is_exr(output))
                      : is_npy               ? band->layers[LAYER_COLOR]
                                             : band_layer_narrowed(values, band, LAYER_COLOR);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (is_exr_layer(output, band, layer)) arrays[count++] = band_layer_narrowed(values, band, layer);
    if (output->options->alpha) arrays[count++] = band_layer_narrowed(values, band, LAYER_COVERAGE);
    if (!image_writer_layer_rows(output->writers[0], arrays, band->height, messages)) return false;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (output->writers[1 + layer] &&
            !image_writer_rows(output->writers[1 + layer], band_layer_values(values, band, layer),
                               band->height, messages))
            return false;
    return true;
}

static void *band_thread(void *argument)
{
    BandCopy *copy = argument;
    ImageOutput *output = copy->output;
    pthread_mutex_lock(&output->mutex);
    while (output->written_count != copy->number)
        pthread_cond_wait(&output->changed, &output->mutex);
    pthread_mutex_unlock(&output->mutex);
    const double start = clock_seconds();
    if (!output->failed) output->failed = !band_write(output, &copy->band, copy->messages);
    copy->failed = output->failed;
    output->seconds += clock_seconds() - start;
    pthread_mutex_lock(&output->mutex);
    output->written_count++;
    pthread_cond_broadcast(&output->changed);
    pthread_mutex_unlock(&output->mutex);
    return NULL;
}

// Waits for the copy's thread. Returns false if this band or an earlier one could not be written.
static bool copy_written(BandCopy *copy)
{
    if (copy->has_thread) pthread_join(copy->thread, NULL);
    copy->has_thread = false;
    return !copy->failed;
}

// Waits for all threads. Returns false if a band could not be written.
static bool bands_written(ImageOutput *output)
{
    bool written = true;
    for (size_t i = 0; i < COPIES; i++)
        written = copy_written(&output->copies[i]) && written;
    return written;
}

// Copies the band, because the renderer reuses its memory for the next band.
static void band_keep(BandCopy *copy, const Film *band)
{
    copy->band = *band;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (!band->layers[layer]) continue;
        size_t size = film_layer_size(band, layer);
        copy->band.layers[layer] =
            memcpy(band_scratch_reserve(&copy->layers[layer], size), band->layers[layer], size);
    }
}

double image_output_bytes(const ImageOutput *output)
{
    return output->bytes;
}

static bool band_output(ImageOutput *output, const Film *band, MessageList *messages)
{
    if (!output->opened && !files_open(output, band, messages)) return false;
    output->opened = true;
    BandCopy *copy = &output->copies[output->band_count % COPIES];
    if (!copy_written(copy)) return false;
    copy->output = output;
    copy->messages = messages;
    copy->number = output->band_count++;
    band_keep(copy, band);
    copy->has_thread =
        !output->options->synchronous && pthread_create(&copy->thread, NULL, band_thread, copy) == 0;
    if (copy->has_thread) return true; // a failure is reported with a later band
    band_thread(copy);
    return !copy->failed;
}

bool image_output_write(ImageOutput *output, const Film *band, MessageList *messages)
{
    output->rerenders = rerender_counts_add(output->rerenders, band->rerenders);
    if (!keeps_bands(output)) return band_output(output, band, messages);
    array_push(output->kept, film_copy(band));
    return true;
}

static bool kept_write(ImageOutput *output, MessageList *messages)
{
    bool written = true;
    for (size_t i = 0; i < output->kept.count && written; i++)
        written = band_output(output, &output->kept.items[i], messages);
    return written;
}

// Adds the notes that follow the pixels.
static bool late_notes_write(ImageOutput *output, MessageList *messages)
{
    if (output->origin.settings->precision != PRECISION_CERTIFIED || keeps_bands(output)) return true;
    OWNED char *counts = counts_describe(&output->rerenders);
    return image_writer_note(output->writers[0], &(ImageNote){certified_key, counts}, messages);
}

RerenderCounts image_output_rerenders(const ImageOutput *output)
{
    return output->rerenders;
}

static void image_output_free(ImageOutput *output)
{
    for (size_t i = 0; i < output->kept.count; i++)
        film_free(&output->kept.items[i]);
    free(output->kept.items);
    band_values_free(&output->values);
    for (size_t i = 0; i < COPIES; i++)
        for (Layer layer = 0; layer < LAYER_COUNT; layer++)
            free(output->copies[i].layers[layer].items);
    pthread_cond_destroy(&output->changed);
    pthread_mutex_destroy(&output->mutex);
    free(output);
}

static void names_print(const ImageOutput *output)
{
    fprintf(stderr, "glint: wrote %s", output->options->path);
    for (Layer i = 0; i < LAYER_COUNT; i++) {
        if (!output->writers[1 + i]) continue;
        OWNED char *path = image_output_aov_path(output->options, layer_names[i]);
        fprintf(stderr, ", %s", path);
    }
    fprintf(stderr, "\n");
}

bool image_output_commit(ImageOutput *output, MessageList *messages, double *seconds)
{
    ImageWriter **writers = output->writers;
    const bool is_kept = kept_write(output, messages);
    bool whole =
        bands_written(output) && is_kept && late_notes_write(output, messages); // joins the writers first
    const double start = clock_seconds();
    for (size_t i = 0; i < COUNT_OF(output->writers) && whole; i++)
        whole = !writers[i] || image_writer_finish(writers[i], messages);
    for (size_t i = 0; i < COUNT_OF(output->writers); i++) {
        if (whole && writers[i])
            whole = image_writer_commit(writers[i], messages);
        else
            image_writer_abandon(writers[i]);
    }
    if (whole && image_output_is_stdout(output->options->path) && fflush(stdout) != 0) {
        whole = message_error(messages, "cannot write to standard output: %s", strerror(errno));
        clearerr(stdout);
    }
    *seconds = output->seconds + (clock_seconds() - start);
    if (whole && output->options->prints_names) names_print(output);
    image_output_free(output);
    return whole;
}

void image_output_abandon(ImageOutput *output)
{
    bands_written(output);
    for (size_t i = 0; i < COUNT_OF(output->writers); i++)
        image_writer_abandon(output->writers[i]);
    image_output_free(output);
}
