// Finds layers by OpenEXR's "Technical Introduction" (2013), "Naming conventions". A channel's name is its
// layer's name, a dot and a base name. In a file of several parts, a part's name is the layer of its
// channels that have none. Those of the first part are also the default layer.
#include "host/image/exr_layers.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef enum { BASE_R, BASE_G, BASE_B, BASE_Y, BASE_RY, BASE_BY, BASE_X, BASE_Z, BASE_COUNT } Base;

// Bounds the time for a hostile file, in which each layer is compared with all others.
enum { LAYERS_MAX = 4096 };

typedef struct {
    const char *name; // not terminated
    size_t length;
    int part;
    int first;             // channel other than alpha, or -1
    int bases[BASE_COUNT]; // channels, or -1
    uint32_t count;        // of channels without alpha
    int alpha;             // or -1
} Candidate;

typedef struct {
    ARRAY_OF(Candidate);
    bool has_more; // than LAYERS_MAX, which are left out
} CandidateList;

static Base base_of(const char *name)
{
    static const struct {
        const char *name;
        Base base;
    } names[] = {{"R", BASE_R},   {"G", BASE_G},     {"B", BASE_B},   {"Y", BASE_Y},
                 {"RY", BASE_RY}, {"BY", BASE_BY},   {"X", BASE_X},   {"Z", BASE_Z},
                 {"red", BASE_R}, {"green", BASE_G}, {"blue", BASE_B}};
    for (size_t i = 0; i < COUNT_OF(names); i++)
        if (strcasecmp(name, names[i].name) == 0) return names[i].base;
    return BASE_COUNT;
}

static bool is_alpha(const char *base)
{
    return strcasecmp(base, "A") == 0 || strcasecmp(base, "alpha") == 0;
}

// Returns the candidate of a layer, after adding it if it is missing, or NULL if the list is full.
static Candidate *candidate_of(CandidateList *list, int part, const char *name, size_t length)
{
    for (size_t i = list->count; i-- > 0;) {
        Candidate *known = &list->items[i];
        if (known->part == part && known->length == length && memcmp(known->name, name, length) == 0)
            return known;
    }
    list->has_more = list->count == LAYERS_MAX;
    if (list->has_more) return NULL;
    Candidate candidate = {.name = name, .length = length, .part = part, .first = -1, .alpha = -1};
    for (size_t i = 0; i < BASE_COUNT; i++)
        candidate.bases[i] = -1;
    array_push(*list, candidate);
    return &list->items[list->count - 1];
}

static exr_result_t candidates_add_part(CandidateList *list, exr_const_context_t context, int part)
{
    exr_storage_t storage;
    const exr_attr_chlist_t *channels;
    exr_result_t code = exr_get_storage(context, part, &storage);
    EXR_STEP(code, exr_get_channels(context, part, &channels));
    if (code != EXR_ERR_SUCCESS) return code;
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED) return EXR_ERR_SUCCESS;
    const char *part_name = NULL;
    if (part == 0 || exr_get_name(context, part, &part_name) != EXR_ERR_SUCCESS || !part_name) part_name = "";
    for (int i = 0; i < channels->num_channels; i++) {
        const char *name = channels->entries[i].name.str, *dot = strrchr(name, '.');
        const char *base = dot ? dot + 1 : name;
        Candidate *candidate =
            candidate_of(list, part, dot ? name : part_name, dot ? (size_t)(dot - name) : strlen(part_name));
        if (!candidate) return EXR_ERR_SUCCESS;
        const exr_attr_chlist_entry_t *entry = &channels->entries[i];
        if (is_alpha(base)) {
            if (entry->pixel_type != EXR_PIXEL_UINT && entry->x_sampling == 1 && entry->y_sampling == 1)
                candidate->alpha = i;
            continue;
        }
        if (candidate->first < 0) candidate->first = i;
        candidate->count++;
        const Base type = base_of(base);
        if (type < BASE_COUNT && candidate->bases[type] < 0) candidate->bases[type] = i;
    }
    return EXR_ERR_SUCCESS;
}

static bool has_light(ExrForm form)
{
    return form == EXR_COLORS || form == EXR_GRAY || form == EXR_CHROMA;
}

static ExrLayer layer_of(const Candidate *candidate)
{
    const int *bases = candidate->bases;
    ExrLayer layer = {.part = candidate->part, .form = EXR_OTHER};
#define LAYER(condition, layer_form, size, ...)                                                              \
    if (layer.form == EXR_OTHER && (condition))                                                              \
    layer = (ExrLayer){candidate->part, layer_form, {__VA_ARGS__}, size}
    LAYER(bases[BASE_R] >= 0 && bases[BASE_G] >= 0 && bases[BASE_B] >= 0, EXR_COLORS, 3, bases[BASE_R],
          bases[BASE_G], bases[BASE_B]);
    LAYER(bases[BASE_X] >= 0 && bases[BASE_Y] >= 0 && bases[BASE_Z] >= 0, EXR_DIRECTION, 3, bases[BASE_X],
          bases[BASE_Y], bases[BASE_Z]);
    LAYER(bases[BASE_Y] >= 0 && bases[BASE_RY] >= 0 && bases[BASE_BY] >= 0, EXR_CHROMA, 3, bases[BASE_Y],
          bases[BASE_RY], bases[BASE_BY]);
    LAYER(bases[BASE_Y] >= 0 && bases[BASE_RY] < 0 && bases[BASE_BY] < 0, EXR_GRAY, 1, bases[BASE_Y]);
    LAYER(candidate->count == 1, EXR_NUMBERS, 1, candidate->first);
#undef LAYER
    if (candidate->alpha >= 0 && has_light(layer.form)) {
        layer.has_alpha = true;
        layer.channels[layer.channel_count] = candidate->alpha;
    }
    return layer;
}

// Bounds the bytes of names that a message shows.
enum { NAMES_SHOWN = 200 };

static void names_add(Text *names, const char *name, size_t length)
{
    if (names->count < NAMES_SHOWN)
        text_appendf(names, "%s%.*s", names->count > 0 ? ", " : "", (int)length, name);
    else if (names->items[names->count - 1] != '.')
        text_appendf(names, ", ...");
}

static bool channels_refuse(exr_const_context_t context, const ImageFile *file, const char *problem)
{
    OwnedText names = {0};
    int part_count = 0;
    exr_get_count(context, &part_count);
    for (int part = 0; part < part_count; part++) {
        const exr_attr_chlist_t *channels;
        if (exr_get_channels(context, part, &channels) != EXR_ERR_SUCCESS) continue;
        for (int i = 0; i < channels->num_channels; i++)
            names_add(&names, channels->entries[i].name.str, strlen(channels->entries[i].name.str));
    }
    return image_refuse(file, "EXR: %s; its channels are %s", problem,
                        names.count > 0 ? text_c(&names) : "none");
}

// Returns false with a message that lists the layers with light, or those without, as ambiguous.
static bool layers_refuse(const CandidateList *list, const ImageFile *file, bool with_light)
{
    OwnedText names = {0};
    for (size_t i = 0; i < list->count; i++) {
        const Candidate *candidate = &list->items[i];
        const ExrForm form = layer_of(candidate).form;
        if (form == EXR_OTHER || has_light(form) != with_light) continue;
        if (candidate->length > 0)
            names_add(&names, candidate->name, candidate->length);
        else
            names_add(&names, "default", strlen("default"));
    }
    return image_refuse(file, "EXR: several layers, %s; name one", text_c(&names));
}

static bool part_has_name(exr_const_context_t context, int part, const char *name)
{
    const char *part_name = NULL;
    return exr_get_name(context, part, &part_name) == EXR_ERR_SUCCESS && part_name &&
           strcmp(part_name, name) == 0;
}

// Returns the layer of a name, otherwise the channels without a layer in a part of that name, or NULL.
static const Candidate *candidate_named(exr_const_context_t context, const CandidateList *list,
                                        const char *name)
{
    const Candidate *of_part = NULL;
    for (size_t i = 0; i < list->count; i++) {
        const Candidate *candidate = &list->items[i];
        if (candidate->length == strlen(name) && memcmp(candidate->name, name, candidate->length) == 0)
            return candidate;
        if (!of_part && candidate->length == 0 && part_has_name(context, candidate->part, name))
            of_part = candidate;
    }
    return of_part;
}

static bool named_layer_find(exr_const_context_t context, const CandidateList *list, const ImageFile *file,
                             ExrLayer *layer)
{
    const char *name = file->options.layer;
    const Candidate *candidate = candidate_named(context, list, name);
    if (candidate) *layer = layer_of(candidate);
    if (candidate && layer->form != EXR_OTHER) return true;
    char problem[128];
    if (candidate)
        snprintf(problem, sizeof problem,
                 "its layer '%.40s' has neither colors, luminance, X, Y and Z, nor one channel", name);
    else
        snprintf(problem, sizeof problem, "it has no layer '%.40s'", name);
    return channels_refuse(context, file, problem);
}

static bool unnamed_layer_find(exr_const_context_t context, const CandidateList *list, const ImageFile *file,
                               ExrLayer *layer)
{
    for (int with_light = 1; with_light >= 0; with_light--) {
        size_t found = 0;
        for (size_t i = 0; i < list->count; i++) {
            const ExrLayer candidate = layer_of(&list->items[i]);
            if (candidate.form == EXR_OTHER || has_light(candidate.form) != with_light) continue;
            *layer = candidate;
            if (list->items[i].length == 0) return true;
            found++;
        }
        if (found == 1) return true;
        if (found > 1) return layers_refuse(list, file, with_light);
    }
    return channels_refuse(context, file, "no layer has red, green and blue, or luminance");
}

bool exr_layer_find(exr_const_context_t context, const ImageFile *file, ExrLayer *layer)
{
    OWNED CandidateList list = {0};
    int part_count = 0;
    exr_result_t code = exr_get_count(context, &part_count);
    for (int part = 0; part < part_count && code == EXR_ERR_SUCCESS && !list.has_more; part++)
        code = candidates_add_part(&list, context, part);
    if (code != EXR_ERR_SUCCESS) return image_refuse(file, "EXR: %s", exr_get_default_error_message(code));
    if (list.has_more) return image_refuse(file, "EXR: more than %d layers", LAYERS_MAX);
    if (list.count == 0 && part_count > 0) return image_refuse(file, "EXR: deep images are not supported");
    return file->options.layer ? named_layer_find(context, &list, file, layer)
                               : unnamed_layer_find(context, &list, file, layer);
}
