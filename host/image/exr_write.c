// OpenEXR output through the C core (Technical Introduction to OpenEXR, 2013): 32-bit floats, ZIP in blocks
// of 16 rows.
#include "host/image/codec.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <errno.h>
#include <openexr.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    exr_context_t context;
    exr_encode_pipeline_t pipeline;
    bool has_pipeline;
    exr_result_t (*compress)(exr_encode_pipeline_t *pipeline); // the library's
    float *block;                                              // rows of the incomplete block
    uint32_t block_rows, rows_held, block_start;
    int write_error; // errno of a failed write
} ExrWriter;

// Silences the library, which calls this with its lock taken: the context must not be used here.
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

// The first failure of a sequence of calls.
#define EXR_STEP(code, call) ((code) = (code) ? (code) : (call))

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
    EXR_STEP(code, exr_initialize_required_attr_simple(state->context, 0, (int32_t)header->width,
                                                       (int32_t)header->height, EXR_COMPRESSION_ZIP));
    const char *names = header->channels == 1 ? "Y" : "BGR";
    for (const char *name = names; *name; name++)
        EXR_STEP(code, exr_add_channel(state->context, 0, (char[]){*name, '\0'}, EXR_PIXEL_FLOAT,
                                       EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    for (const ImageNote *note = header->notes; note && note->key; note++) {
        // The prefix separates keys such as `version` from the format's own.
        Text key = {0};
        text_appendf(&key, "glint.%s", note->key);
        EXR_STEP(code, exr_attr_set_string(state->context, 0, text_c(&key), note->value));
        text_free(&key);
    }
    EXR_STEP(code, exr_write_header(state->context));
    int32_t block_rows = 0;
    EXR_STEP(code, exr_get_scanlines_per_chunk(state->context, 0, &block_rows));
    state->block_rows = (uint32_t)block_rows;
    return code;
}

static bool exr_begin(ImageWriter *writer, MessageList *messages)
{
    const ImageHeader *header = &writer->header;
    ExrWriter *state = writer->state = memory_allocate_zeroed(1, sizeof *state);
    if (header->channels != 1 && header->channels != 3)
        fault("EXR is written with 1 or 3 channels, not %u", header->channels);
    // The block offset table precedes the blocks and is written last.
    if (fseeko(writer->output.file, 0, SEEK_SET) != 0)
        return message_error(messages, "cannot write '%s': EXR needs a file, not a pipe",
                             writer->output.target);
    exr_result_t code = exr_header(writer);
    if (code != EXR_ERR_SUCCESS) return exr_write_failed(writer, code, messages);
    state->block =
        memory_allocate((size_t)state->block_rows * header->width * header->channels, sizeof(float));
    return true;
}

// EXR orders its channels by name: B, G, R.
static size_t channel_place(const char *name)
{
    return *name == 'B' ? 2 : *name == 'G' ? 1 : 0;
}

// A block of its uncompressed size is read as uncompressed. OpenEXR 3.1 and 3.4.7 store compressed bytes of
// that size as well (its issue 2306).
static exr_result_t exr_compress(exr_encode_pipeline_t *pipeline)
{
    const ExrWriter *state = pipeline->encoding_user_data;
    exr_result_t code = state->compress(pipeline);
    if (code == EXR_ERR_SUCCESS && pipeline->compressed_bytes == pipeline->packed_bytes)
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, (size_t)pipeline->packed_bytes);
    return code;
}

// Writes the buffered rows as one block.
static exr_result_t exr_block(ImageWriter *writer)
{
    ExrWriter *state = writer->state;
    exr_chunk_info_t chunk;
    exr_encode_pipeline_t *pipeline = &state->pipeline;
    exr_result_t code = exr_write_scanline_chunk_info(state->context, 0, (int)state->block_start, &chunk);
    if (code != EXR_ERR_SUCCESS) return code;
    bool is_first = !state->has_pipeline;
    code = is_first ? exr_encoding_initialize(state->context, 0, &chunk, pipeline)
                    : exr_encoding_update(state->context, 0, &chunk, pipeline);
    if (code != EXR_ERR_SUCCESS) return code;
    state->has_pipeline = true;
    uint32_t pixel_size = writer->header.channels * (uint32_t)sizeof(float);
    for (int i = 0; i < pipeline->channel_count; i++) {
        exr_coding_channel_info_t *channel = &pipeline->channels[i];
        channel->encode_from_ptr = (const uint8_t *)(state->block + channel_place(channel->channel_name));
        channel->user_pixel_stride = (int32_t)pixel_size;
        channel->user_line_stride = (int32_t)(pixel_size * writer->header.width);
        channel->user_bytes_per_element = sizeof(float);
        channel->user_data_type = EXR_PIXEL_FLOAT;
    }
    if (is_first) {
        code = exr_encoding_choose_default_routines(state->context, 0, pipeline);
        state->compress = pipeline->compress_fn;
        pipeline->compress_fn = exr_compress;
        pipeline->encoding_user_data = state;
    }
    EXR_STEP(code, exr_encoding_run(state->context, 0, pipeline));
    state->block_start += state->rows_held;
    state->rows_held = 0;
    return code;
}

static bool exr_rows(ImageWriter *writer, const void *pixels, uint32_t row_count, MessageList *messages)
{
    const ImageHeader *header = &writer->header;
    ExrWriter *state = writer->state;
    size_t row_values = (size_t)header->width * header->channels;
    for (uint32_t row = 0; row < row_count; row++) {
        memcpy(state->block + state->rows_held * row_values, (const float *)pixels + row * row_values,
               row_values * sizeof(float));
        state->rows_held++;
        if (state->rows_held < state->block_rows && state->block_start + state->rows_held < header->height)
            continue;
        exr_result_t code = exr_block(writer);
        if (code != EXR_ERR_SUCCESS) return exr_write_failed(writer, code, messages);
    }
    return true;
}

static exr_result_t exr_close(ExrWriter *state)
{
    if (state->has_pipeline) exr_encoding_destroy(state->context, &state->pipeline);
    state->has_pipeline = false;
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
    free(state->block);
    free(state);
}

const Encoder exr_encoder = {exr_begin, exr_rows, exr_end, exr_free, NULL};
