#include "host/base/json.h"
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <inttypes.h>
#include <libfyaml.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct Json {
    struct fy_emitter *emitter;
    Text text;
    bool *items; // whether each open container is an object
    size_t count, capacity;
};

// libfyaml (0.7, 0.8) drops spaces at the ends of a text that YAML could write plainly, even in quotes. They
// are passed as a noncharacter (The Unicode Standard 15.0, section 23.7), which no text has.
static const char space_stand_in[] = "\xEF\xB7\x90", replacement_character[] = "\xEF\xBF\xBD";

static int json_output(struct fy_emitter *emitter, enum fy_emitter_write_type type, const char *text,
                       int length, void *json)
{
    (void)emitter, (void)type;
    text_append(&((Json *)json)->text, text, (size_t)length);
    return length;
}

static void json_emit(Json *json, struct fy_event *event)
{
    if (!event || fy_emit_event(json->emitter, event) != 0) fault("libfyaml cannot write JSON");
}

static void json_emit_scalar(Json *json, enum fy_scalar_style style, const char *value, size_t length)
{
    json_emit(json, fy_emit_event_create(json->emitter, FYET_SCALAR, style, value, length, NULL, NULL));
}

static void json_emit_text(Json *json, const char *value)
{
    Text passed = {0};
    size_t length = strlen(value), first = strspn(value, " "), last = length;
    while (last > first && value[last - 1] == ' ')
        last--;
    for (size_t i = 0, size; i < length; i += size ? size : 1) {
        size = text_character_size(value + i, length - i);
        if (i < first || i >= last)
            text_append(&passed, space_stand_in, 3);
        else if (size == 0 || strncmp(value + i, space_stand_in, 3) == 0)
            text_append(&passed, replacement_character, 3);
        else
            text_append(&passed, value + i, size);
    }
    json_emit_scalar(json, FYSS_DOUBLE_QUOTED, text_c(&passed), passed.count);
    text_free(&passed);
}

static void json_emit_key(Json *json, const char *key)
{
    if (json->count == 0 || json->items[json->count - 1] != (key != NULL))
        fault("JSON: %s", key ? "a key outside an object" : "an object's value without a key");
    if (key) json_emit_text(json, key);
}

static void json_begin(Json *json, bool is_object)
{
    enum fy_event_type type = is_object ? FYET_MAPPING_START : FYET_SEQUENCE_START;
    json_emit(json, fy_emit_event_create(json->emitter, type, FYNS_ANY, NULL, NULL));
    array_push(*json, is_object);
}

Json *json_open(void)
{
    Json *json = memory_allocate_zeroed(1, sizeof *json);
    struct fy_emitter_cfg settings = {
        .flags = FYECF_MODE_JSON | FYECF_WIDTH_INF, .output = json_output, .userdata = json};
    json->emitter = fy_emitter_create(&settings);
    if (!json->emitter) fault("libfyaml cannot write JSON");
    json_emit(json, fy_emit_event_create(json->emitter, FYET_STREAM_START));
    json_emit(json, fy_emit_event_create(json->emitter, FYET_DOCUMENT_START, 1, NULL, NULL));
    json_begin(json, true);
    return json;
}

void json_begin_object(Json *json, const char *key)
{
    json_emit_key(json, key);
    json_begin(json, true);
}

void json_begin_array(Json *json, const char *key)
{
    json_emit_key(json, key);
    json_begin(json, false);
}

void json_end(Json *json)
{
    if (json->count == 0) fault("JSON: nothing is open");
    enum fy_event_type type = json->items[--json->count] ? FYET_MAPPING_END : FYET_SEQUENCE_END;
    json_emit(json, fy_emit_event_create(json->emitter, type));
}

static void json_word(Json *json, const char *key, const char *word)
{
    json_emit_key(json, key);
    json_emit_scalar(json, FYSS_PLAIN, word, strlen(word));
}

void json_text(Json *json, const char *key, const char *value)
{
    if (!value) {
        json_none(json, key);
        return;
    }
    json_emit_key(json, key);
    json_emit_text(json, value);
}

void json_number(Json *json, const char *key, double value)
{
    char word[32] = "null";
    if (isfinite(value)) {
        // 17 digits always suffice (Goldberg, What every computer scientist should know about
        // floating-point arithmetic, 1991, theorem 15).
        int digits = 1;
        do
            snprintf(word, sizeof word, "%.*g", digits, value);
        while (digits++ < 17 && strtod(word, NULL) != value);
    }
    json_word(json, key, word);
}

void json_int64(Json *json, const char *key, int64_t value)
{
    char word[32];
    snprintf(word, sizeof word, "%" PRId64, value);
    json_word(json, key, word);
}

void json_bool(Json *json, const char *key, bool value)
{
    json_word(json, key, value ? "true" : "false");
}

void json_none(Json *json, const char *key)
{
    json_word(json, key, "null");
}

void json_print(Json *json, FILE *stream)
{
    while (json->count)
        json_end(json);
    json_emit(json, fy_emit_event_create(json->emitter, FYET_DOCUMENT_END, 1));
    json_emit(json, fy_emit_event_create(json->emitter, FYET_STREAM_END));
    fy_emitter_destroy(json->emitter);

    const char *from = text_c(&json->text), *end = from + json->text.count, *at;
    while (end > from && end[-1] == '\n')
        end--;
    while ((at = memmem(from, (size_t)(end - from), space_stand_in, 3))) {
        fwrite(from, 1, (size_t)(at - from), stream);
        fputc(' ', stream);
        from = at + 3;
    }
    fwrite(from, 1, (size_t)(end - from), stream);
    fputc('\n', stream);
    text_free(&json->text);
    free(json->items);
    free(json);
}
