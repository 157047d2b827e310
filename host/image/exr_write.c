// Writes OpenEXR through the C core (Technical Introduction to OpenEXR, 2013), as 32-bit floats and integers
// with ZIP in blocks of 16 rows.
#include "host/image/exr_layers.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/text.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

// The color, or another layer.
typedef struct {
    char *channels; // names, each ended by a null
    size_t channel_count;
    bool is_integer;
    uint8_t *rows_held; // of a block that is not complete
} WrittenLayer;

// A channel of the file and the indices of its layer and of its value in each pixel.
typedef struct {
    const char *name;
    size_t layer, value;
} ExrChannel;

enum { VALUE_BYTES = 4, BLOCKS_MAX = 16 };

// A block of rows in the queue, which threads compress. A queue's buffers have about twice its rows' size.
typedef struct {
    exr_encode_pipeline_t pipeline;
    bool has_pipeline; // kept and reused
    exr_result_t code;
} ExrBlock;

typedef struct {
    exr_context_t context;
    ExrBlock blocks[BLOCKS_MAX];
    size_t block_count;
    exr_result_t (*compress)(exr_encode_pipeline_t *pipeline); // the library's
    exr_result_t (*write)(exr_encode_pipeline_t *pipeline);    // the library's
    WrittenLayer layers[1 + IMAGE_LAYERS_MAX];
    size_t layer_count;
    ExrChannel *channels; // of all layers, by name, as in the file
    size_t channel_count;
    uint32_t block_rows, rows_held, block_start;
    int write_error; // errno of a failed write
} ExrWriter;

// Silences the library, which calls this with its lock held, so that the context must not be used here.
static void exr_keep_silent(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)context, (void)code, (void)message;
}

static int64_t exr_write_bytes(exr_const_context_t context, void *user_data, const void *bytes, uint64_t size,
                               uint64_t offset, exr_stream_error_func_ptr_t fail)
{
    (void)context, (void)fail;
    ImageWriter *writer = user_data;
    FILE *file = writer->output.file;
    if (fseeko(file, (off_t)offset, SEEK_SET) == 0 && fwrite(bytes, 1, (size_t)size, file) == size)
        return (int64_t)size;
    ((ExrWriter *)writer->state)->write_error = errno;
    return -1;
}

static bool exr_write_failed(ImageWriter *writer, exr_result_t code, MessageList *messages)
{
    const ExrWriter *state = writer->state;
    return message_error(messages, "cannot write '%s': %s", writer->output.target,
                         state->write_error ? strerror(state->write_error)
                                            : exr_get_default_error_message(code));
}

static void layer_add(ExrWriter *state, const ImageLayer *layer)
{
    WrittenLayer *added = &state->layers[state->layer_count++];
    *added = (WrittenLayer){.channels = memory_copy_text(layer->channels),
                            .channel_count = layer->channel_count,
                            .is_integer = layer->type == 'u'};
    for (char *at = added->channels; (at = strchr(at, ','));)
        *at++ = '\0';
}

static int channels_compare(const void *a, const void *b)
{
    return strcmp(((const ExrChannel *)a)->name, ((const ExrChannel *)b)->name);
}

static void channels_list(ExrWriter *state)
{
    for (size_t i = 0; i < state->layer_count; i++)
        state->channel_count += state->layers[i].channel_count;
    ExrChannel *channel = state->channels = memory_allocate(state->channel_count, sizeof *channel);
    for (size_t i = 0; i < state->layer_count; i++) {
        const char *name = state->layers[i].channels;
        for (size_t k = 0; k < state->layers[i].channel_count; k++, name += strlen(name) + 1)
            *channel++ = (ExrChannel){name, i, k};
    }
    qsort(state->channels, state->channel_count, sizeof *state->channels, channels_compare);
}

static exr_result_t channels_declare(const ExrWriter *state)
{
    exr_result_t code = EXR_ERR_SUCCESS;
    for (size_t i = 0; i < state->channel_count; i++) {
        const ExrChannel *channel = &state->channels[i];
        const exr_pixel_type_t type =
            state->layers[channel->layer].is_integer ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        EXR_STEP(code,
                 exr_add_channel(state->context, 0, channel->name, type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    }
    return code;
}

static exr_result_t exr_declare_size(const ImageWriter *writer)
{
    const ImageHeader *header = &writer->header;
    const bool is_whole = header->full_width == 0;
    const int32_t left = (int32_t)header->left, top = (int32_t)header->top;
    const int32_t width = (int32_t)header->width, height = (int32_t)header->height;
    const int32_t full_width = is_whole ? width : (int32_t)header->full_width;
    const int32_t full_height = is_whole ? height : (int32_t)header->full_height;
    const exr_attr_box2i_t display = {.max.x = full_width - 1, .max.y = full_height - 1};
    const exr_attr_box2i_t data = {
        .min.x = left, .min.y = top, .max.x = left + width - 1, .max.y = top + height - 1};
    return exr_initialize_required_attr(((const ExrWriter *)writer->state)->context, 0, &display, &data, 1,
                                        &(exr_attr_v2f_t){.x = 0}, 1, EXR_LINEORDER_INCREASING_Y,
                                        EXR_COMPRESSION_ZIP);
}

static exr_result_t exr_header(ImageWriter *writer)
{
    const ImageHeader *header = &writer->header;
    ExrWriter *state = writer->state;
    exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
    settings.error_handler_fn = exr_keep_silent;
    settings.user_data = writer;
    settings.write_fn = exr_write_bytes;
    // Level 4 makes files 4 to 8% larger than level 9 on smooth images, equal on noise.
    settings.zip_level = 4;
    exr_result_t code =
        exr_start_write(&state->context, writer->output.target, EXR_WRITE_FILE_DIRECTLY, &settings);
    int part;
    EXR_STEP(code, exr_set_longname_support(state->context, 1));
    EXR_STEP(code, exr_add_part(state->context, "", EXR_STORAGE_SCANLINE, &part));
    EXR_STEP(code, exr_declare_size(writer));
    layer_add(state, &(ImageLayer){header->channels == 1 ? "Y" : "R,G,B", header->channels, 'f'});
    for (size_t i = 0; i < header->layer_count; i++)
        layer_add(state, &header->layers[i]);
    channels_list(state);
    EXR_STEP(code, channels_declare(state));
    for (const ImageNote *note = header->notes; note && note->key; note++) {
        // The prefix separates keys such as `version` from the format's own.
        OWNED char *key = text_format("glint.%s", note->key);
        EXR_STEP(code, exr_attr_set_string(state->context, 0, key, note->value));
    }
    EXR_STEP(code, exr_write_header(state->context));
    int32_t block_rows = 0;
    EXR_STEP(code, exr_get_scanlines_per_chunk(state->context, 0, &block_rows));
    state->block_rows = (uint32_t)block_rows;
    return code;
}

static size_t layer_row_size(const ImageWriter *writer, const WrittenLayer *layer)
{
    return writer->header.width * layer->channel_count * VALUE_BYTES;
}

static bool exr_begin(ImageWriter *writer, MessageList *messages)
{
    const ImageHeader *header = &writer->header;
    ExrWriter *state = writer->state = memory_allocate_zeroed(1, sizeof *state);
    if ((header->channels != 1 && header->channels != 3) || header->layer_count > IMAGE_LAYERS_MAX)
        fault("EXR is written with 1 or 3 channels and few layers, not %u and %zu", header->channels,
              header->layer_count);
    // The block offset table precedes the blocks and is written last.
    if (fseeko(writer->output.file, 0, SEEK_SET) != 0)
        return message_error(messages, "cannot write '%s': EXR needs a file, not a pipe",
                             writer->output.target);
    exr_result_t code = exr_header(writer);
    if (code != EXR_ERR_SUCCESS) return exr_write_failed(writer, code, messages);
    for (size_t i = 0; i < state->layer_count; i++)
        state->layers[i].rows_held =
            memory_allocate(state->block_rows, layer_row_size(writer, &state->layers[i]));
    return true;
}

// The rows of a block by layer, in the caller's arrays or in rows_held.
typedef struct {
    const uint8_t *layers[1 + IMAGE_LAYERS_MAX];
} BlockRows;

// Points a channel of the file at its values in the block's rows.
static void encoded_channel_place(const ExrWriter *state, exr_encode_pipeline_t *pipeline,
                                  const BlockRows *rows, int index, uint32_t width)
{
    const ExrChannel *from = &state->channels[index];
    const WrittenLayer *layer = &state->layers[from->layer];
    exr_coding_channel_info_t *channel = &pipeline->channels[index];
    const size_t pixel_bytes = layer->channel_count * VALUE_BYTES;
    channel->encode_from_ptr = rows->layers[from->layer] + from->value * VALUE_BYTES;
    channel->user_pixel_stride = (int32_t)pixel_bytes;
    channel->user_line_stride = (int32_t)(pixel_bytes * width);
    channel->user_bytes_per_element = VALUE_BYTES;
    channel->user_data_type = layer->is_integer ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
}

// Compresses a block. Stores it uncompressed if compression does not change its size, because such a block
// is read as uncompressed. OpenEXR 3.1 and 3.4.7 store the compressed bytes (its issue 2306).
static exr_result_t exr_compress(exr_encode_pipeline_t *pipeline)
{
    const ExrWriter *state = pipeline->encoding_user_data;
    exr_result_t code = state->compress(pipeline);
    if (code == EXR_ERR_SUCCESS && pipeline->compressed_bytes == pipeline->packed_bytes)
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, (size_t)pipeline->packed_bytes);
    return code;
}

static void blocks_compress(void *context, size_t begin, size_t end)
{
    ExrWriter *state = context;
    for (size_t i = begin; i < end; i++)
        state->blocks[i].code = exr_encoding_run(state->context, 0, &state->blocks[i].pipeline);
}

static exr_result_t blocks_write(ExrWriter *state)
{
    exr_result_t code = EXR_ERR_SUCCESS;
    parallel_run(state->block_count, 1, blocks_compress, state);
    for (size_t i = 0; i < state->block_count; i++) {
        EXR_STEP(code, state->blocks[i].code);
        EXR_STEP(code, state->write(&state->blocks[i].pipeline));
    }
    state->block_count = 0;
    return code;
}

// Lets the library choose a pipeline's functions for packing, compressing and writing. Postpones writing to
// the file's order, because the default functions fail for any block but the next.
static exr_result_t pipeline_prepare(ExrWriter *state, exr_encode_pipeline_t *pipeline)
{
    const exr_result_t code = exr_encoding_choose_default_routines(state->context, 0, pipeline);
    state->compress = pipeline->compress_fn;
    state->write = pipeline->write_fn;
    pipeline->compress_fn = exr_compress;
    pipeline->yield_until_ready_fn = pipeline->write_fn = NULL;
    pipeline->encoding_user_data = state;
    return code;
}

// Queues a block, and writes the queue if it is full. The rows must stay valid until then.
static exr_result_t block_add(ImageWriter *writer, const BlockRows *rows, uint32_t row_count)
{
    ExrWriter *state = writer->state;
    ExrBlock *block = &state->blocks[state->block_count];
    exr_encode_pipeline_t *pipeline = &block->pipeline;
    exr_chunk_info_t chunk;
    exr_result_t code = exr_write_scanline_chunk_info(state->context, 0,
                                                      (int)(writer->header.top + state->block_start), &chunk);
    const bool is_first = !block->has_pipeline;
    EXR_STEP(code, is_first ? exr_encoding_initialize(state->context, 0, &chunk, pipeline)
                            : exr_encoding_update(state->context, 0, &chunk, pipeline));
    if (code != EXR_ERR_SUCCESS) return code;
    block->has_pipeline = true;
    for (int i = 0; i < pipeline->channel_count; i++)
        encoded_channel_place(state, pipeline, rows, i, writer->header.width);
    if (is_first) code = pipeline_prepare(state, pipeline);
    if (code != EXR_ERR_SUCCESS) return code;
    state->block_count++;
    state->block_start += row_count;
    state->rows_held = 0;
    if (state->block_count == BLOCKS_MAX) EXR_STEP(code, blocks_write(state));
    return code;
}

// Copies rows into rows_held. First writes the queue, which may still refer to rows_held.
static exr_result_t rows_hold(ImageWriter *writer, const BlockRows *rows, uint32_t row_count)
{
    ExrWriter *state = writer->state;
    const exr_result_t code = state->rows_held == 0 ? blocks_write(state) : EXR_ERR_SUCCESS;
    for (size_t i = 0; i < state->layer_count; i++) {
        const size_t row_size = layer_row_size(writer, &state->layers[i]);
        memcpy(state->layers[i].rows_held + state->rows_held * row_size, rows->layers[i],
               row_count * row_size);
    }
    state->rows_held += row_count;
    return code;
}

static bool exr_rows(ImageWriter *writer, const void *const *arrays, uint32_t row_count,
                     MessageList *messages)
{
    ExrWriter *state = writer->state;
    exr_result_t code = EXR_ERR_SUCCESS;
    BlockRows held;
    for (size_t i = 0; i < state->layer_count; i++)
        held.layers[i] = state->layers[i].rows_held;
    for (uint32_t row = 0, count; row < row_count && code == EXR_ERR_SUCCESS; row += count) {
        const uint32_t left = writer->header.height - state->block_start;
        const uint32_t block_rows = left < state->block_rows ? left : state->block_rows;
        BlockRows rows;
        for (size_t i = 0; i < state->layer_count; i++)
            rows.layers[i] = (const uint8_t *)arrays[i] + row * layer_row_size(writer, &state->layers[i]);
        count = block_rows - state->rows_held;
        if (count > row_count - row) count = row_count - row;
        if (count == block_rows) {
            code = block_add(writer, &rows, block_rows);
        } else {
            code = rows_hold(writer, &rows, count);
            if (state->rows_held == block_rows) EXR_STEP(code, block_add(writer, &held, block_rows));
        }
    }
    EXR_STEP(code, blocks_write(state));
    return code == EXR_ERR_SUCCESS || exr_write_failed(writer, code, messages);
}

static exr_result_t exr_close(ExrWriter *state)
{
    for (size_t i = 0; i < BLOCKS_MAX; i++) {
        if (state->blocks[i].has_pipeline) exr_encoding_destroy(state->context, &state->blocks[i].pipeline);
        state->blocks[i].has_pipeline = false;
    }
    return state->context ? exr_finish(&state->context) : EXR_ERR_SUCCESS;
}

static bool exr_end(ImageWriter *writer, MessageList *messages)
{
    exr_result_t code = exr_close(writer->state);
    return code == EXR_ERR_SUCCESS || exr_write_failed(writer, code, messages);
}

static void exr_free(ImageWriter *writer)
{
    ExrWriter *state = writer->state;
    if (!state) return;
    exr_close(state);
    for (size_t i = 0; i < state->layer_count; i++) {
        free(state->layers[i].channels);
        free(state->layers[i].rows_held);
    }
    free(state->channels);
    free(state);
}

const Encoder exr_encoder = {exr_begin, exr_rows, exr_end, exr_free, NULL};
