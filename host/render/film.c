#include "host/render/film.h"

#include "host/base/memory.h"
#include "host/base/numbers.h"
#include <stdlib.h>
#include <string.h>

#define LAYER_NAME(NAME, name, ...) #name,
const char *const layer_names[LAYER_COUNT] = {LAYER_LIST(LAYER_NAME)};

#define LAYER_TYPE(NAME, name, type, ...) LAYER_TYPE_##type,
const LayerType layer_types[LAYER_COUNT] = {LAYER_LIST(LAYER_TYPE)};

#define LAYER_COMPONENTS(NAME, name, type, components, note) components,
static const uint32_t layer_components[LAYER_COUNT] = {LAYER_LIST(LAYER_COMPONENTS)};

uint32_t film_components(const Film *film, Layer layer)
{
    return layer_components[layer] == PER_LIGHT ? film->light_count : layer_components[layer];
}

size_t film_layer_size(const Film *film, Layer layer)
{
    const size_t value_size = layer_types[layer] == LAYER_TYPE_INTEGER ? sizeof(uint32_t) : film->real_size;
    return memory_product(memory_product(film_pixel_count(film), film_components(film, layer)), value_size);
}

size_t film_size(const Film *film)
{
    const FilmHeader header = film_header(film);
    return (size_t)film_header_size(&header);
}

FilmHeader film_header(const Film *film)
{
    FilmHeader header = {.width = film->width,
                         .first_row = film->first_row,
                         .row_count = film->height,
                         .light_count = film->light_count,
                         .real_size = (uint32_t)film->real_size,
                         .is_double = film->is_double,
                         .rerenders = film->rerenders};
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (film->layers[layer]) header.layers |= UINT64_C(1) << layer;
    return header;
}

static Film film_without_layers(const FilmHeader *header)
{
    return (Film){.width = header->width,
                  .height = header->row_count,
                  .light_count = header->light_count,
                  .first_row = header->first_row,
                  .is_double = header->is_double,
                  .real_size = header->real_size,
                  .rerenders = header->rerenders};
}

bool film_header_fits(const FilmHeader *band, const FilmHeader *image)
{
    FilmHeader expected = *image;
    expected.first_row = band->first_row;
    expected.row_count = band->row_count;
    expected.rerenders = band->rerenders;
    return memcmp(band, &expected, sizeof expected) == 0 && band->row_count > 0 &&
           band->row_count <= image->row_count && band->first_row <= image->row_count - band->row_count;
}

uint64_t film_header_size(const FilmHeader *header)
{
    const Film film = film_without_layers(header);
    uint64_t size = 0;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (layer_in(header->layers, layer)) size += film_layer_size(&film, layer);
    return size;
}

Film film_of_header(const FilmHeader *header)
{
    Film film = film_without_layers(header);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (layer_in(header->layers, layer))
            film.layers[layer] = memory_allocate(film_layer_size(&film, layer), 1);
    return film;
}

Film film_allocate(uint32_t width, uint32_t height, uint32_t light_count, unsigned aovs)
{
    Film film = {.width = width, .height = height, .light_count = light_count, .real_size = sizeof(double)};
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (layer_in(aovs | AOV_COLOR, layer))
            film.layers[layer] = memory_allocate_zeroed(film_layer_size(&film, layer), 1);
    return film;
}

Film film_copy(const Film *band)
{
    Film copy = *band;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (band->layers[layer])
            copy.layers[layer] = memory_copy(band->layers[layer], film_layer_size(band, layer), 1);
    return copy;
}

void film_free(Film *film)
{
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        free(film->layers[layer]);
    *film = (Film){0};
}

void film_copy_band(Film *film, const Film *band)
{
    film->rerenders = rerender_counts_add(film->rerenders, band->rerenders);
    for (Layer layer = 0; layer < LAYER_COUNT; layer++) {
        if (!film->layers[layer] || !band->layers[layer]) continue;
        size_t row_size = film_layer_size(film, layer) / film->height;
        void *rows = (char *)film->layers[layer] + band->first_row * row_size;
        if (layer_types[layer] == LAYER_TYPE_INTEGER)
            memcpy(rows, band->layers[layer], film_layer_size(band, layer));
        else
            numbers_widen(rows, band->layers[layer], film_layer_size(band, layer) / band->real_size,
                          band->real_size == sizeof(double));
    }
}

float *film_narrow_color(const Film *film)
{
    const size_t count = 3 * film_pixel_count(film);
    float *narrow = memory_allocate(count, sizeof *narrow);
    numbers_narrow(narrow, film->color, count);
    return narrow;
}
