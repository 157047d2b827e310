// Films: the color of an image's pixels and their AOVs in host memory, one layer each. The layers are listed
// in kernels/aovs.h.
#pragma once

#include "host/base/memory.h"
#include "kernels/aovs.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LAYER_NUMBER(NAME, ...) LAYER_##NAME,
typedef enum { LAYER_LIST(LAYER_NUMBER) LAYER_COUNT } Layer;

// Sets of layers, as bits.
#define LAYER_BIT(NAME, ...)        AOV_##NAME = 1 << LAYER_##NAME,
#define LAYER_BIT_OF_SET(NAME, ...) | 1 << LAYER_##NAME
enum {
    LAYER_LIST(LAYER_BIT) AOVS_OF_HIT = 0 HIT_AOV_LIST(LAYER_BIT_OF_SET),
    AOVS_OF_PATH = 0 PATH_AOV_LIST(LAYER_BIT_OF_SET),
    AOVS_ALL = (1 << LAYER_COUNT) - 1
};

extern const char *const layer_names[LAYER_COUNT]; // "t", …, as in file names and --aov

typedef enum { LAYER_TYPE_REAL, LAYER_TYPE_LENGTH, LAYER_TYPE_INTEGER } LayerType;
extern const LayerType layer_types[LAYER_COUNT];

#define FILM_REAL                         double
#define FILM_LENGTH                       double
#define FILM_INTEGER                      uint32_t
#define FILM_LAYER(NAME, name, type, ...) FILM_##type *name;

// At `certified`, of samples and of AOVs' rays: those of the pixels that were rendered in double, and of
// these the ones that double left in doubt.
typedef struct {
    uint64_t repeated, undecided;
} RepeatCounts;

static inline RepeatCounts repeat_counts_add(RepeatCounts a, RepeatCounts b)
{
    return (RepeatCounts){a.repeated + b.repeated, a.undecided + b.undecided};
}

enum { DOUBT_REPEATED = 1, DOUBT_UNDECIDED }; // what the AOV says of such a pixel

// Every pixel of an image's region or of a band of its rows, row by row from the top left. Layers are NULL
// where they were not requested.
//
// Reals are doubles, except in a band that was computed in float: there they are floats, and are read through
// layers[] and real_size alone, never by name.
//
// Of a miss t is infinite, normal and position are 0, object is UINT32_MAX. Positions are relative to the
// eye. A path is a signature of what the ray met (kernels/types.h).
typedef struct {
    uint32_t width, height, light_count;
    uint32_t first_row; // of a band in its region
    bool is_double;     // computed in double
    size_t real_size;   // sizeof(double); sizeof(float) in a band that was not
    RepeatCounts repeats;
    union {
        void *layers[LAYER_COUNT];
        struct {
            LAYER_LIST(FILM_LAYER)
        };
    };
} Film;

// The rows of a band in its region; row_count 0: none.
typedef struct {
    uint32_t first_row, row_count;
} BandRows;

// A film as files and messages describe it; the bytes of its layers follow in their order.
typedef struct {
    uint32_t width, first_row, row_count, light_count, real_size, is_double;
    uint64_t layers; // the set of those that are there
    RepeatCounts repeats;
} FilmHeader;

static inline size_t film_pixel_count(const Film *film)
{
    return memory_product(film->width, film->height);
}

// Values per pixel.
uint32_t film_components(const Film *film, Layer layer);
// Of the whole layer, in bytes, whether it is there or not.
size_t film_layer_size(const Film *film, Layer layer);

// Of all layers that are there, in bytes.
size_t film_size(const Film *film);

FilmHeader film_header(const Film *film);
// Whether a header, which may come from anywhere, is that of a band of rows of the image.
bool film_header_fits(const FilmHeader *band, const FilmHeader *image);
// Of the layers that a header describes, in bytes.
uint64_t film_header_size(const FilmHeader *header);
// The film that a header describes, with layers whose values are undefined.
Film film_of_header(const FilmHeader *header);

// A film of zeros in double with the color and the AOVs of the set.
Film film_allocate(uint32_t width, uint32_t height, uint32_t light_count, unsigned aovs);
Film film_copy(const Film *band); // with layers of its own
void film_free(Film *film);       // and zeroes

// Copies the rows of a band into the film, all layers that both have, and adds its counts; reals become
// doubles.
void film_copy_band(Film *film, const Film *band);

float *film_narrow_color(const Film *film); // caller frees
