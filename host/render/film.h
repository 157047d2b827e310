// A film holds the color and the AOVs of an image's pixels in host memory, one layer each. The layers are
// listed in kernels/aovs.h.
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
    AOVS_OF_SAMPLES = 0 SAMPLED_AOV_LIST(LAYER_BIT_OF_SET),
    AOVS_ALL = (1 << LAYER_COUNT) - 1
};

// Returns whether the set has the layer.
static inline bool layer_in(uint64_t layers, Layer layer)
{
    return layers >> layer & 1;
}

extern const char *const layer_names[LAYER_COUNT]; // "t" and so on, as in file names and in --aov

typedef enum { LAYER_TYPE_REAL, LAYER_TYPE_LENGTH, LAYER_TYPE_INTEGER } LayerType;
extern const LayerType layer_types[LAYER_COUNT];

#define FILM_REAL                         double
#define FILM_LENGTH                       double
#define FILM_INTEGER                      uint32_t
#define FILM_LAYER(NAME, name, type, ...) FILM_##type *name;

// At `certified`, the number of samples and of AOVs' rays whose pixels were re-rendered in double precision,
// and the number of these that remained uncertified.
typedef struct {
    uint64_t rerendered, uncertified;
} RerenderCounts;

static inline RerenderCounts rerender_counts_add(RerenderCounts a, RerenderCounts b)
{
    return (RerenderCounts){a.rerendered + b.rerendered, a.uncertified + b.uncertified};
}

// Values of the AOV `flag`: the pixel was flagged and re-rendered in double precision; it remained
// uncertified.
enum { FLAG_RERENDERED = 1, FLAG_UNCERTIFIED };

// Every pixel of an image's region, or of a band of the region's rows, row by row from the top left. Layers
// that were not requested are NULL.
//
// Reals are doubles, except in a band that was computed in float. There they are floats, and must be read
// through layers[] and real_size, never by name.
//
// Where a ray misses, t is infinite, normal and position are 0, and object is UINT32_MAX. Positions are
// relative to the eye. A path is a signature of the surfaces that the ray tree hits (kernels/types.h).
typedef struct {
    uint32_t width, height, light_count;
    uint32_t first_row; // the band's, counted in the region
    // The number of samples in the color, which is their sum until all are in and then their mean. 0 for a
    // film that is not a delivered band, and for a band that is read from a checkpoint.
    uint32_t samples;
    bool is_double;   // whether it was computed in double
    size_t real_size; // sizeof(float) in a band that was computed in float, else sizeof(double)
    RerenderCounts rerenders;
    union {
        void *layers[LAYER_COUNT];
        struct {
            LAYER_LIST(FILM_LAYER)
        };
    };
} Film;

// The rows of a band, counted in the region. A row_count of 0 means none.
typedef struct {
    uint32_t first_row, row_count;
} BandRows;

// Describes a film in files and messages. The bytes of its layers follow in the layers' order.
typedef struct {
    uint32_t width, first_row, row_count, light_count, real_size, is_double;
    uint64_t layers; // the set of the film's layers
    RerenderCounts rerenders;
} FilmHeader;

static inline size_t film_pixel_count(const Film *film)
{
    return memory_product(film->width, film->height);
}

// Returns the number of values per pixel.
uint32_t film_components(const Film *film, Layer layer);
// Returns the size of a layer in bytes, whether the film has that layer or not.
size_t film_layer_size(const Film *film, Layer layer);

// Returns the size of all layers that the film has, in bytes.
size_t film_size(const Film *film);

FilmHeader film_header(const Film *film);
// Returns whether a header, which may come from an untrusted source, describes a band of the image's rows.
bool film_header_fits(const FilmHeader *band, const FilmHeader *image);
// Returns the size of the layers that a header describes, in bytes.
uint64_t film_header_size(const FilmHeader *header);
// Returns the film that a header describes. The values in its layers are undefined.
Film film_of_header(const FilmHeader *header);

// Returns a film of zeros in double precision, with the color and the AOVs of the set.
Film film_allocate(uint32_t width, uint32_t height, uint32_t light_count, unsigned aovs);
// Returns a copy that has separate layers.
Film film_copy(const Film *band);
// Frees the layers and sets the film to zeros.
void film_free(Film *film);
#define OwnedFilm __attribute__((cleanup(film_free))) Film

// Copies the rows of a band into the film and adds the band's counts. Copies every layer that both have, with
// reals converted to double.
void film_copy_band(Film *film, const Film *band);

// Returns the color rounded to float. The caller frees it.
float *film_narrow_color(const Film *film);
