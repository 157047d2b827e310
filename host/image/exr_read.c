// OpenEXR input through the C core: the first part at full resolution, scan lines or tiles, halves or floats.
#include "host/image/codec.h"

#include "host/base/memory.h"

#include <openexr.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const ImageFile *file;
    exr_context_t context;
    const exr_attr_chlist_t *list;
    int chosen[3]; // indices in the channel list, in image order
    exr_attr_box2i_t window;
    char problem[256];
} ExrReader;

static void exr_note_problem(exr_const_context_t context, exr_result_t code, const char *message)
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

// Like pread, returns fewer bytes at the end of the file: the library reads ahead past a header of unknown
// size.
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

static int channel_find(const exr_attr_chlist_t *list, const char *name)
{
    for (int i = 0; i < list->num_channels; i++) {
        if (strcmp(list->entries[i].name.str, name) == 0) return i;
    }
    return -1;
}

// R, G, B; else Y; else the first three channels, or the first of fewer.
static uint32_t channels_choose(ExrReader *reader, Image *image)
{
    const exr_attr_chlist_t *list = reader->list;
    static const char *const colors[] = {"R", "G", "B"};
    bool has_colors = true;
    for (int i = 0; i < 3; i++) {
        reader->chosen[i] = channel_find(list, colors[i]);
        has_colors = has_colors && reader->chosen[i] >= 0;
    }
    if (has_colors) return 3;
    int luminance = channel_find(list, "Y");
    image->data = luminance < 0;
    for (int i = 0; i < 3; i++)
        reader->chosen[i] = luminance >= 0 ? luminance : i;
    return luminance >= 0 || list->num_channels < 3 ? 1 : 3;
}

static bool exr_prepare(ExrReader *reader, Image *image)
{
    exr_result_t code = exr_get_channels(reader->context, 0, &reader->list);
    if (code == EXR_ERR_SUCCESS) code = exr_get_data_window(reader->context, 0, &reader->window);
    int32_t chunk_count = 0;
    if (code == EXR_ERR_SUCCESS) code = exr_get_chunk_count(reader->context, 0, &chunk_count);
    if (code != EXR_ERR_SUCCESS) return exr_refuse(reader, code);
    if (reader->list->num_channels < 1 || chunk_count < 1)
        return image_refuse(reader->file, "EXR: the image is empty");
    uint32_t channels = channels_choose(reader, image);
    for (uint32_t i = 0; i < channels; i++) {
        const exr_attr_chlist_entry_t *entry = &reader->list->entries[reader->chosen[i]];
        if (entry->pixel_type == EXR_PIXEL_UINT || entry->x_sampling != 1 || entry->y_sampling != 1)
            return image_refuse(reader->file, "EXR: channel %s is not of floats or not of full resolution",
                                entry->name.str);
    }
    // Each block has a table entry and a header; even a constant image compresses by less than 65536 to 1.
    int64_t width = (int64_t)reader->window.max.x - reader->window.min.x + 1;
    int64_t height = (int64_t)reader->window.max.y - reader->window.min.y + 1;
    if ((uint64_t)chunk_count > reader->file->length / 16)
        return image_refuse(reader->file, "EXR: the file is too short for its image");
    return image_allocate(image, reader->file, width < 0 ? 0 : (uint64_t)width,
                          height < 0 ? 0 : (uint64_t)height, channels, 65536);
}

// Destination of a channel's values: the image, or a scratch buffer. OpenEXR 3.1 writes through the null
// pointer that should make it skip a channel if there are three channels of halves.
static void channel_place(exr_coding_channel_info_t *channel, float *place, uint32_t pixel_values,
                          uint32_t row_pixels)
{
    channel->decode_to_ptr = (uint8_t *)place;
    channel->user_pixel_stride = (int32_t)(pixel_values * sizeof *place);
    channel->user_line_stride = (int32_t)(pixel_values * row_pixels * sizeof *place);
}

static void channels_place(const ExrReader *reader, Image *image, exr_decode_pipeline_t *pipeline,
                           float *scratch, uint32_t x, uint32_t y)
{
    for (int i = 0; i < pipeline->channel_count; i++)
        channel_place(&pipeline->channels[i], scratch, 1, (uint32_t)pipeline->chunk.width);
    float *place = image->values + ((size_t)y * image->width + x) * image->channels;
    for (uint32_t i = 0; i < image->channels; i++) {
        exr_coding_channel_info_t *channel = &pipeline->channels[reader->chosen[i]];
        channel_place(channel, place + i, image->channels, image->width);
        channel->user_bytes_per_element = sizeof *place;
        channel->user_data_type = EXR_PIXEL_FLOAT;
    }
}

// Decodes one block of rows or one tile into the image.
static exr_result_t exr_chunk(const ExrReader *reader, Image *image, const exr_chunk_info_t *chunk,
                              uint32_t x, uint32_t y)
{
    if (chunk->width < 1 || chunk->height < 1 || (uint64_t)chunk->width + x > image->width ||
        (uint64_t)chunk->height + y > image->height)
        return EXR_ERR_BAD_CHUNK_LEADER;
    exr_decode_pipeline_t pipeline = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_result_t code = exr_decoding_initialize(reader->context, 0, chunk, &pipeline);
    if (code != EXR_ERR_SUCCESS) return code;
    float *scratch = memory_allocate((size_t)chunk->width * (size_t)chunk->height, sizeof *scratch);
    channels_place(reader, image, &pipeline, scratch, x, y);
    code = exr_decoding_choose_default_routines(reader->context, 0, &pipeline);
    if (code == EXR_ERR_SUCCESS) code = exr_decoding_run(reader->context, 0, &pipeline);
    exr_decoding_destroy(reader->context, &pipeline);
    free(scratch);
    return code;
}

static exr_result_t exr_scanlines(const ExrReader *reader, Image *image)
{
    int32_t block_rows;
    exr_result_t code = exr_get_scanlines_per_chunk(reader->context, 0, &block_rows);
    if (code == EXR_ERR_SUCCESS && block_rows < 1) return EXR_ERR_FILE_BAD_HEADER;
    for (uint32_t y = 0; code == EXR_ERR_SUCCESS && y < image->height; y += (uint32_t)block_rows) {
        exr_chunk_info_t chunk;
        int row = (int)((int64_t)reader->window.min.y + y);
        code = exr_read_scanline_chunk_info(reader->context, 0, row, &chunk);
        if (code == EXR_ERR_SUCCESS) code = exr_chunk(reader, image, &chunk, 0, y);
    }
    return code;
}

static exr_result_t exr_tiles(const ExrReader *reader, Image *image)
{
    int32_t tile_width, tile_height;
    exr_result_t code = exr_get_tile_sizes(reader->context, 0, 0, 0, &tile_width, &tile_height);
    if (code == EXR_ERR_SUCCESS && (tile_width < 1 || tile_height < 1)) return EXR_ERR_FILE_BAD_HEADER;
    for (uint32_t y = 0, row = 0; code == EXR_ERR_SUCCESS && y < image->height;
         y += (uint32_t)tile_height, row++) {
        for (uint32_t x = 0, column = 0; code == EXR_ERR_SUCCESS && x < image->width;
             x += (uint32_t)tile_width, column++) {
            exr_chunk_info_t chunk;
            code = exr_read_tile_chunk_info(reader->context, 0, (int)column, (int)row, 0, 0, &chunk);
            if (code == EXR_ERR_SUCCESS) code = exr_chunk(reader, image, &chunk, x, y);
        }
    }
    return code;
}

static bool exr_pixels(ExrReader *reader, Image *image)
{
    exr_storage_t storage;
    exr_result_t code = exr_get_storage(reader->context, 0, &storage);
    if (code == EXR_ERR_SUCCESS && storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED)
        return image_refuse(reader->file, "EXR: deep images are not supported");
    if (!exr_prepare(reader, image)) return false;
    if (code == EXR_ERR_SUCCESS)
        code = storage == EXR_STORAGE_TILED ? exr_tiles(reader, image) : exr_scanlines(reader, image);
    return code == EXR_ERR_SUCCESS || exr_refuse(reader, code);
}

bool exr_decode(Image *image, const ImageFile *file)
{
    ExrReader reader = {.file = file};
    exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
    settings.error_handler_fn = exr_note_problem;
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
