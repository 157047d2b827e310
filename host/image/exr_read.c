// Reads OpenEXR through the C core. Supports one layer at full resolution, in scan lines or tiles, of halves
// or floats, or of integers with a single channel.
#include "host/base/array.h"
#include "host/image/codec.h"
#include "host/image/exr_layers.h"

#include "host/base/memory.h"

#include <math.h>
#include <openexr.h>
#include <stdlib.h>
#include <string.h>

// A channel's values, one per sample.
typedef struct {
    int channel; // index in the part's channel list
    float *values;
    uint32_t width, height;
    uint32_t across, down; // pixels per sample
    bool is_integer;       // the bits are of uint32
} ExrPlane;

typedef struct {
    const ImageFile *file;
    exr_context_t context;
    ExrLayer layer;
    exr_attr_box2i_t window; // pixels with data
    int64_t left, top;       // of the image in these
    ExrPlane planes[4];
    char problem[256];
} ExrReader;

static void exr_record_problem(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)code;
    void *user_data = NULL;
    if (!context || exr_get_user_data(context, &user_data) != EXR_ERR_SUCCESS || !user_data) return;
    ExrReader *reader = user_data;
    if (!reader->problem[0]) // the first message is closest to the cause
        snprintf(reader->problem, sizeof reader->problem, "%s", message);
}

static int64_t exr_size(exr_const_context_t context, void *reader)
{
    (void)context;
    return (int64_t)((ExrReader *)reader)->file->length;
}

// Reads bytes, fewer at the file's end, like pread. The library reads ahead past a header of unknown size.
static int64_t exr_read_bytes(exr_const_context_t context, void *reader, void *bytes, uint64_t size,
                              uint64_t offset, exr_stream_error_func_ptr_t fail)
{
    (void)context, (void)fail;
    const ImageFile *file = ((ExrReader *)reader)->file;
    if (offset >= file->length) return 0;
    if (size > file->length - offset) size = file->length - offset;
    memcpy(bytes, file->bytes + offset, (size_t)size);
    return (int64_t)size;
}

static bool exr_refuse(const ExrReader *reader, exr_result_t code)
{
    return image_refuse(reader->file, "EXR: %s",
                        reader->problem[0] ? reader->problem : exr_get_default_error_message(code));
}

static uint32_t sample_count(uint32_t pixels, int sampling)
{
    return sampling > 0 ? (pixels + (uint32_t)sampling - 1) / (uint32_t)sampling : 0;
}

static uint64_t window_extent(int32_t min, int32_t max)
{
    return max < min ? 0 : (uint64_t)((int64_t)max - min + 1);
}

static uint32_t plane_count(const ExrLayer *layer)
{
    return layer->channel_count + layer->has_alpha;
}

// Sets up a plane per channel of the layer; `store` holds their values.
static bool planes_allocate(ExrReader *reader, Image *store)
{
    const exr_attr_chlist_t *list = NULL;
    const ExrLayer *layer = &reader->layer;
    exr_result_t code = exr_get_channels(reader->context, layer->part, &list);
    int32_t chunk_count = 0;
    EXR_STEP(code, exr_get_chunk_count(reader->context, layer->part, &chunk_count));
    if (code != EXR_ERR_SUCCESS) return exr_refuse(reader, code);
    if (chunk_count < 1) return image_refuse(reader->file, "EXR: the image is empty");
    // Each block has a table entry and a header; even a constant image compresses by less than 65536 to 1.
    if ((uint64_t)chunk_count > reader->file->length / 16)
        return image_refuse(reader->file, "EXR: the file is too short for its image");
    const exr_attr_box2i_t *window = &reader->window;
    if (!image_allocate(store, reader->file, window_extent(window->min.x, window->max.x),
                        window_extent(window->min.y, window->max.y), plane_count(layer), 65536))
        return false;
    for (uint32_t i = 0; i < plane_count(layer); i++) {
        const exr_attr_chlist_entry_t *entry = &list->entries[layer->channels[i]];
        const bool is_full = entry->x_sampling == 1 && entry->y_sampling == 1;
        const bool is_integer = entry->pixel_type == EXR_PIXEL_UINT;
        if ((is_integer && layer->form != EXR_NUMBERS) || !(is_full || layer->form == EXR_CHROMA))
            return image_refuse(reader->file, "EXR: channel %s is not of floats or not of full resolution",
                                entry->name.str);
        reader->planes[i] = (ExrPlane){layer->channels[i],
                                       store->values + (size_t)i * store->width * store->height,
                                       sample_count(store->width, entry->x_sampling),
                                       sample_count(store->height, entry->y_sampling),
                                       (uint32_t)entry->x_sampling,
                                       (uint32_t)entry->y_sampling,
                                       is_integer};
    }
    return true;
}

// Sets the destination of a channel's values: a plane, or a scratch buffer. OpenEXR 3.1 writes through the
// null pointer that should make it skip a channel if there are three channels of halves.
static void decoded_channel_place(exr_coding_channel_info_t *channel, float *place, uint32_t row_values)
{
    channel->decode_to_ptr = (uint8_t *)place;
    channel->user_pixel_stride = sizeof *place;
    channel->user_line_stride = (int32_t)(row_values * sizeof *place);
}

// Sets the destinations of a block at pixel (x, y) of the data. Returns false if it exceeds the planes.
static bool channels_place(const ExrReader *reader, exr_decode_pipeline_t *pipeline, float *scratch,
                           uint32_t x, uint32_t y)
{
    for (int i = 0; i < pipeline->channel_count; i++)
        decoded_channel_place(&pipeline->channels[i], scratch, (uint32_t)pipeline->chunk.width);
    for (uint32_t i = 0; i < plane_count(&reader->layer); i++) {
        const ExrPlane *plane = &reader->planes[i];
        exr_coding_channel_info_t *channel = &pipeline->channels[plane->channel];
        const uint32_t column = x / plane->across, row = y / plane->down;
        if (channel->width < 0 || channel->height < 0 || (uint64_t)channel->width + column > plane->width ||
            (uint64_t)channel->height + row > plane->height)
            return false;
        decoded_channel_place(channel, plane->values + (size_t)row * plane->width + column, plane->width);
        channel->user_bytes_per_element = sizeof *plane->values;
        channel->user_data_type = plane->is_integer ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
    }
    return true;
}

// Decodes one block of rows or one tile.
static exr_result_t exr_chunk(const ExrReader *reader, const exr_chunk_info_t *chunk, uint32_t x, uint32_t y)
{
    if (chunk->width < 1 || chunk->height < 1) return EXR_ERR_BAD_CHUNK_LEADER;
    const int part = reader->layer.part;
    exr_decode_pipeline_t pipeline = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_result_t code = exr_decoding_initialize(reader->context, part, chunk, &pipeline);
    if (code != EXR_ERR_SUCCESS) return code;
    OWNED float *scratch = memory_allocate((size_t)chunk->width * (size_t)chunk->height, sizeof *scratch);
    if (!channels_place(reader, &pipeline, scratch, x, y)) code = EXR_ERR_BAD_CHUNK_LEADER;
    EXR_STEP(code, exr_decoding_choose_default_routines(reader->context, part, &pipeline));
    EXR_STEP(code, exr_decoding_run(reader->context, part, &pipeline));
    exr_decoding_destroy(reader->context, &pipeline);
    return code;
}

static exr_result_t exr_scanlines(const ExrReader *reader, uint32_t height)
{
    const int part = reader->layer.part;
    int32_t block_rows;
    exr_result_t code = exr_get_scanlines_per_chunk(reader->context, part, &block_rows);
    if (code == EXR_ERR_SUCCESS && block_rows < 1) return EXR_ERR_FILE_BAD_HEADER;
    for (uint32_t y = 0; code == EXR_ERR_SUCCESS && y < height; y += (uint32_t)block_rows) {
        exr_chunk_info_t chunk;
        int row = (int)((int64_t)reader->window.min.y + y);
        code = exr_read_scanline_chunk_info(reader->context, part, row, &chunk);
        EXR_STEP(code, exr_chunk(reader, &chunk, 0, y));
    }
    return code;
}

static exr_result_t exr_tiles(const ExrReader *reader, uint32_t width, uint32_t height)
{
    const int part = reader->layer.part;
    int32_t tile_width, tile_height;
    exr_result_t code = exr_get_tile_sizes(reader->context, part, 0, 0, &tile_width, &tile_height);
    if (code == EXR_ERR_SUCCESS && (tile_width < 1 || tile_height < 1)) return EXR_ERR_FILE_BAD_HEADER;
    for (uint32_t y = 0; code == EXR_ERR_SUCCESS && y < height; y += (uint32_t)tile_height)
        for (uint32_t x = 0; code == EXR_ERR_SUCCESS && x < width; x += (uint32_t)tile_width) {
            const int column = (int)x / tile_width, row = (int)y / tile_height;
            exr_chunk_info_t chunk;
            code = exr_read_tile_chunk_info(reader->context, part, column, row, 0, 0, &chunk);
            EXR_STEP(code, exr_chunk(reader, &chunk, x, y));
        }
    return code;
}

// Copies the value at a pixel of the data. Interpolates bilinearly between samples.
static void plane_sample(const ExrPlane *plane, uint32_t x, uint32_t y, float *pixel)
{
    const uint32_t column = x / plane->across, row = y / plane->down;
    const float *value = plane->values + (size_t)row * plane->width + column;
    if (plane->across == 1 && plane->down == 1) {
        memcpy(pixel, value, sizeof *pixel); // perhaps of an integer, whose bits x87 would change
        return;
    }
    const size_t right = column + 1 < plane->width ? 1 : 0,
                 below = row + 1 < plane->height ? plane->width : 0;
    const float along = (float)(x % plane->across) / (float)plane->across;
    const float down = (float)(y % plane->down) / (float)plane->down;
    const float upper = value[0] + along * (value[right] - value[0]);
    *pixel = upper + down * (value[below] + along * (value[below + right] - value[below]) - upper);
}

// Converts luminance and chroma to colors, as in OpenEXR's "Technical Introduction" (2013), "Luminance/chroma
// images", with the weights of Rec. 709.
static void chroma_convert(float *pixel)
{
    const float luminance = pixel[0];
    pixel[0] = (pixel[1] + 1) * luminance;
    pixel[2] = (pixel[2] + 1) * luminance;
    pixel[1] = (luminance - 0.2126F * pixel[0] - 0.0722F * pixel[2]) / 0.7152F;
}

// Converts integers to floats and to doubles, which hold each of them exactly.
static void integers_widen(Image *image)
{
    const size_t count = (size_t)image->width * image->height;
    image->integers = true;
    image->doubles = memory_allocate(count, sizeof *image->doubles);
    for (size_t i = 0; i < count; i++) {
        uint32_t value;
        memcpy(&value, &image->values[i], sizeof value);
        image->doubles[i] = value;
        image->values[i] = (float)value;
    }
}

// Fills the image, which is the display window. Pixels outside the data stay 0.
static void image_fill(const ExrReader *reader, Image *image, uint32_t width, uint32_t height)
{
    for (uint32_t y = 0; y < image->height; y++) {
        for (uint32_t x = 0; x < image->width; x++) {
            const int64_t column = x + reader->left, row = y + reader->top;
            if (column < 0 || column >= width || row < 0 || row >= height) continue;
            float *pixel = image->values + ((size_t)y * image->width + x) * image->channels;
            for (uint32_t i = 0; i < image->channels; i++)
                plane_sample(&reader->planes[i], (uint32_t)column, (uint32_t)row, &pixel[i]);
            if (reader->layer.form == EXR_CHROMA) chroma_convert(pixel);
            if (!image->alpha) continue;
            float *alpha = image->alpha + (size_t)y * image->width + x;
            plane_sample(&reader->planes[reader->layer.channel_count], (uint32_t)column, (uint32_t)row,
                         alpha);
            *alpha = *alpha < 1 ? fmaxf(*alpha, 0) : 1; // NaN becomes 1
        }
    }
}

// Allocates a zeroed alpha for an image with transparent pixels, such as those outside the data window.
static void alpha_open(const ExrReader *reader, Image *image, uint32_t width, uint32_t height)
{
    if (!reader->layer.has_alpha) return;
    const ExrPlane *plane = &reader->planes[reader->layer.channel_count];
    bool is_opaque = reader->left >= 0 && reader->top >= 0 && reader->left + image->width <= width &&
                     reader->top + image->height <= height;
    for (size_t i = 0; i < (size_t)width * height && is_opaque; i++)
        is_opaque = !(plane->values[i] < 1);
    if (!is_opaque)
        image->alpha = memory_allocate_zeroed((size_t)image->width * image->height, sizeof *image->alpha);
}

static void primaries_check(const ExrReader *reader)
{
    static const float rec_709[] = {0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.3127F, 0.329F};
    const exr_attribute_t *attribute;
    if (exr_get_attribute_by_name(reader->context, reader->layer.part, "chromaticities", &attribute) !=
            EXR_ERR_SUCCESS ||
        attribute->type != EXR_ATTR_CHROMATICITIES)
        return;
    const exr_attr_chromaticities_t *c = attribute->chromaticities;
    const float found[] = {c->red_x,  c->red_y,  c->green_x, c->green_y,
                           c->blue_x, c->blue_y, c->white_x, c->white_y};
    for (size_t i = 0; i < COUNT_OF(found); i++) {
        if (fabsf(found[i] - rec_709[i]) < 0.001F) continue;
        image_warn(reader->file, "EXR: the chromaticities are ignored; the colors are taken for Rec. 709's");
        return;
    }
}

static bool exr_decode_planes(ExrReader *reader, Image *store)
{
    if (!planes_allocate(reader, store)) return false;
    exr_storage_t storage;
    exr_result_t code = exr_get_storage(reader->context, reader->layer.part, &storage);
    EXR_STEP(code, storage == EXR_STORAGE_TILED ? exr_tiles(reader, store->width, store->height)
                                                : exr_scanlines(reader, store->height));
    return code == EXR_ERR_SUCCESS || exr_refuse(reader, code);
}

static bool exr_pixels(ExrReader *reader, Image *image)
{
    ExrLayer *layer = &reader->layer;
    if (!exr_layer_find(reader->context, reader->file, layer)) return false;
    exr_attr_box2i_t display; // pixels of the image
    exr_result_t code = exr_get_data_window(reader->context, layer->part, &reader->window);
    EXR_STEP(code, exr_get_display_window(reader->context, layer->part, &display));
    if (code != EXR_ERR_SUCCESS) return exr_refuse(reader, code);
    reader->left = (int64_t)display.min.x - reader->window.min.x;
    reader->top = (int64_t)display.min.y - reader->window.min.y;
    OwnedImage store = {0};
    if (!exr_decode_planes(reader, &store) ||
        !image_allocate(image, reader->file, window_extent(display.min.x, display.max.x),
                        window_extent(display.min.y, display.max.y), layer->channel_count, UINT64_MAX))
        return false;
    image->data = layer->form == EXR_DIRECTION || layer->form == EXR_NUMBERS;
    alpha_open(reader, image, store.width, store.height);
    image_fill(reader, image, store.width, store.height);
    if (reader->planes[0].is_integer) integers_widen(image);
    if (!image->data) primaries_check(reader);
    return true;
}

bool exr_decode(Image *image, const ImageFile *file)
{
    ExrReader reader = {.file = file};
    exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
    settings.error_handler_fn = exr_record_problem;
    settings.user_data = &reader;
    settings.read_fn = exr_read_bytes;
    settings.size_fn = exr_size;
    settings.max_image_width = settings.max_image_height = 1 << 24; // strides are 32-bit
    settings.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    exr_result_t code = exr_start_read(&reader.context, file->path, &settings);
    bool done = code == EXR_ERR_SUCCESS ? exr_pixels(&reader, image) : exr_refuse(&reader, code);
    if (reader.context) exr_finish(&reader.context);
    return done;
}
