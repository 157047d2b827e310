#include "host/cli/film_files.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include "host/base/text.h"
#include <stdlib.h>

ImageHeader film_layer_header(const Film *film, Layer layer)
{
    bool integer = layer_types[layer] == LAYER_TYPE_INTEGER;
    return (ImageHeader){
        .format = IMAGE_NPY,
        .width = film->width,
        .height = film->height,
        .channels = film_components(film, layer),
        .bits = 8,
        .npy_type = integer           ? 'u'
                    : film->is_double ? 'd'
                                      : 'f',
    };
}

static bool layer_save(const Film *film, Layer layer, const char *path, MessageList *messages)
{
    const ImageHeader header = film_layer_header(film, layer);
    const size_t count = film_pixel_count(film) * header.channels;
    OWNED float *narrow = NULL;
    if (header.npy_type == 'f') {
        narrow = memory_allocate(count, sizeof *narrow);
        numbers_narrow(narrow, film->layers[layer], count);
    }
    return image_write(path, &header, narrow ? narrow : film->layers[layer], messages);
}

bool film_save(const Film *film, const char *prefix, MessageList *messages)
{
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (!film->layers[layer] || film_components(film, layer) == 0) continue;
        OWNED char *path = text_format("%s.%s.npy", prefix, layer_names[layer]);
        if (!layer_save(film, layer, path, messages)) return false;
    }
    return true;
}
