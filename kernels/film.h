// Finds the pixels of each work-item in a band of the image, and stores their values.
#ifndef FILM_H
#define FILM_H

#include "aovs.h"
#include "camera.h"

typedef struct {
    uint first_x, first_y, width, height; // in the whole image; in a list, 0, 0, its length and 1
    uint cell;                            // 1, or the side of the squares that have one rendered pixel each
    global const int *list; // for a list, LIST_WORDS words for each pixel: its x and y in the whole image,
                            // its index in the band and its slot in the records of the band's ray trees
} Band;

static inline Band band_of(uint4 pixels, uint cell, global const int *list)
{
    return (Band){pixels.x, pixels.y, pixels.z, pixels.w, cell, list};
}

typedef struct {
    Pixels pixels;
    mask inside;   // pixels inside the band
    bool whole;    // all are inside the band, and the band is not a list
    integer index; // the index of each pixel within a list
    integer slot;  // in a list, the slot of each pixel
    uint first;    // the index of the tile's first pixel within the band
    uint width;    // the band's width
    uint number;   // the tile's number in the order of work-items
} Tile;

// Mixes 32 bits one to one, so that similar numbers give dissimilar results.
static inline uint bits_scramble(uint bits)
{
    bits = (bits ^ (bits >> 16)) * 0x45d9f3bu;
    bits = (bits ^ (bits >> 15)) * 0x2c1b3c6du;
    return bits ^ (bits >> 16);
}

// Returns one pixel of each square of cell x cell pixels with the given corner. A hash chooses it, which
// gives a stratified sample of the image (host/measure/pilot.h). `down` is hashed from all 32 bits, because
// `across` has consumed the leading ones.
static inline Pixels pixels_scatter(Pixels corner, uint cell)
{
    IntegerLanes x = {corner.x}, y = {corner.y};
    for (uint lane = 0; lane < LANES; lane++) {
        uint across = bits_scramble(bits_scramble((uint)x.each[lane] + 1) + (uint)y.each[lane]);
        uint down = bits_scramble(across + 0x9e3779b9u);
        x.each[lane] += mul_hi(across, cell);
        y.each[lane] += mul_hi(down, cell);
    }
    return (Pixels){x.all, y.all};
}

// Returns the work-item's tile number `which` of a list. Its pixels, which `certified` flagged, may be
// anywhere in the image.
static inline Tile list_tile(const Band *band, uint which)
{
    uint first = ((uint)get_global_id(0) * TILES + which) * LANES;
    if (get_global_id(1) > 0) first = band->width; // a list is one row, beyond which work-items are idle
    IntegerLanes index, x, y, inside, slot;
    for (uint lane = 0; lane < LANES; lane++) {
        uint at = min(first + lane, band->width - 1);
        inside.each[lane] = first + lane < band->width ? 1 : 0;
        index.each[lane] = at;
        x.each[lane] = band->list[LIST_WORDS * at];
        y.each[lane] = band->list[LIST_WORDS * at + 1];
        slot.each[lane] = band->list[LIST_WORDS * at + 3];
    }
    Tile tile = {.pixels = {x.all, y.all},
                 .inside = inside.all != (integer)(0),
                 .index = index.all,
                 .slot = slot.all,
                 .width = band->width};
    if (band->cell > 1) tile.pixels = pixels_scatter(tile.pixels, band->cell);
    return tile;
}

// Returns the work-item's tile number `which`, from 0 to TILES - 1.
static inline Tile band_tile(const Band *band, uint which)
{
    if (IS_PIXEL_LIST) return list_tile(band, which);
    Tile tile;
    uint left = ((uint)get_global_id(0) * MACRO_TILE_COLUMNS + which % MACRO_TILE_COLUMNS) * TILE_WIDTH;
    uint top = ((uint)get_global_id(1) * MACRO_TILE_ROWS + (which >> MACRO_TILE_COLUMNS_LOG2)) * TILE_HEIGHT;
    integer x = integer_of(left) + LANE_X, y = integer_of(top) + LANE_Y;
    tile.inside = (x < integer_of(band->width)) & (y < integer_of(band->height));
    tile.whole = left + TILE_WIDTH <= band->width && top + TILE_HEIGHT <= band->height;
    tile.first = top * band->width + left;
    tile.width = band->width;
    const uint item_width = MACRO_TILE_COLUMNS * TILE_WIDTH;
    const uint of_row = (band->width + item_width - 1) / item_width;
    tile.number = ((uint)get_global_id(1) * of_row + (uint)get_global_id(0)) * TILES + which;
    integer cell = integer_of(band->cell);
    tile.pixels.x = x * cell + integer_of(band->first_x);
    tile.pixels.y = y * cell + integer_of(band->first_y);
    if (band->cell > 1) tile.pixels = pixels_scatter(tile.pixels, band->cell);
    return tile;
}

// Returns the index of each pixel within the band.
static inline integer tile_index(const Tile *tile)
{
    if (IS_PIXEL_LIST) return tile->index;
    return integer_of(tile->first) + LANE_Y * integer_of(tile->width) + LANE_X;
}

// Returns the slot of each pixel in the records of the band's ray trees, tile by tile.
static inline integer tile_slots(const Tile *tile)
{
    if (IS_PIXEL_LIST) return tile->slot;
    return integer_of(tile->number * LANES) + LANE_Y * (integer)(TILE_WIDTH) + LANE_X;
}

// The types of a layer's values (aovs.h), and its address in a band's buffer.
#define LAYER_REAL    scalar
#define LAYER_LENGTH  scalar
#define LAYER_INTEGER int
#define LAYER_AT(film, layers, name, type)                                                                   \
    ((global LAYER_##type *)((film) + (size_t)(layers).name * ARENA_UNIT))

// Defines a function that stores one of `stride` values per pixel.
#define FILM_STORE(name, Stored, Value, ValueLanes)                                                          \
    static inline void name(global Stored *film, const Tile *tile, uint stride, uint channel, Value value)   \
    {                                                                                                        \
        ValueLanes values = {value};                                                                         \
        IntegerLanes inside = {tile->inside}, index = {tile_index(tile)};                                    \
        for (uint lane = 0; lane < LANES; lane++)                                                            \
            if (inside.each[lane])                                                                           \
                film[(size_t)index.each[lane] * stride + channel] = (Stored)values.each[lane];               \
    }
FILM_STORE(film_store, scalar, real, RealLanes)
FILM_STORE(film_store_integer, int, integer, IntegerLanes)

#ifdef SHUFFLE_ROWS
// Interleaves a tile's colors: `parts` of a row of four pixels are r g b r, g b r g and b r g b.
static inline void color_interleave(Vector color, real *parts)
{
    const real r = color.x, g = color.y, b = color.z;
    const real rgrg01 = SHUFFLE_ROWS(r, g, 0, LANES, 1, LANES + 1),
               rgrg23 = SHUFFLE_ROWS(r, g, 2, LANES + 2, 3, LANES + 3),
               gb1 = SHUFFLE_ROWS(g, b, 1, LANES + 1, 1, LANES + 1);
    parts[0] = SHUFFLE_ROWS(rgrg01, b, 0, 1, LANES, 2);
    parts[1] = SHUFFLE_ROWS(gb1, rgrg23, 0, 1, LANES, LANES + 1);
    parts[2] = SHUFFLE_ROWS(rgrg23, b, LANES + 2, 2, 3, LANES + 3);
}
#endif

static inline void film_store_vector(global scalar *film, const Tile *tile, Vector vector)
{
#ifdef SHUFFLE_ROWS
    if (tile->whole) {
        real parts[3];
        color_interleave(vector, parts);
        global scalar *row = film + (size_t)tile->first * 3;
#pragma unroll
        for (uint lane = 0; lane < LANES; lane += 4, row += (size_t)tile->width * 3)
#pragma unroll
            for (uint part = 0; part < 3; part++)
                vstore4(vload4(0, (const scalar *)&parts[part] + lane), part, row);
        return;
    }
#endif
    film_store(film, tile, 3, 0, vector.x);
    film_store(film, tile, 3, 1, vector.y);
    film_store(film, tile, 3, 2, vector.z);
}

#if LANES == 16 && defined(SHUFFLE_ROWS)
typedef real UnalignedReal __attribute__((aligned(sizeof(scalar)))); // PoCL's vstore16 stores halves

// Stores the colors of four neighboring tiles, whose rows together fill cache lines.
static inline void film_store_four(global scalar *film, const Tile *tile, const Vector *colors)
{
    real parts[12];
    const size_t next_row = (size_t)tile->width * 3;
    film += (size_t)tile->first * 3;
#pragma unroll
    for (uint i = 0; i < 4; i++)
        color_interleave(colors[i], &parts[3 * i]);
#pragma unroll
    for (uint i = 0; i < 12; i += 4, film += LANES) {
        real a = SELECT_ROWS(parts[i], parts[i + 1], 0, 1), b = SELECT_ROWS(parts[i + 2], parts[i + 3], 0, 1);
        real c = SELECT_ROWS(parts[i], parts[i + 1], 2, 3), d = SELECT_ROWS(parts[i + 2], parts[i + 3], 2, 3);
        *(global UnalignedReal *)film = SELECT_ROWS(a, b, 0, 2);
        *(global UnalignedReal *)(film + next_row) = SELECT_ROWS(a, b, 1, 3);
        *(global UnalignedReal *)(film + 2 * next_row) = SELECT_ROWS(c, d, 0, 2);
        *(global UnalignedReal *)(film + 3 * next_row) = SELECT_ROWS(c, d, 1, 3);
    }
}
#endif

// Stores the colors of PACKETS tiles.
static inline void film_store_tiles(global scalar *film, const Tile *tiles, const Vector *colors)
{
    uint i = 0;
#if LANES == 16 && defined(SHUFFLE_ROWS)
    for (; i + 4 <= PACKETS && tiles[i + 3].whole; i += 4) // if the last one is whole, so are the others
        film_store_four(film, &tiles[i], &colors[i]);
#endif
    for (; i < PACKETS; i++)
        film_store_vector(film, &tiles[i], colors[i]);
}

// Stores the colors of a list's pixels in the film of their band.
static inline void film_merge(global float *band_film, const Band *band, const Tile *tile, Vector color)
{
    RealLanes x = {color.x}, y = {color.y}, z = {color.z};
    IntegerLanes inside = {tile->inside}, index = {tile->index};
    for (uint lane = 0; lane < LANES; lane++) {
        if (!inside.each[lane]) continue;
        global float *pixel = band_film + 3 * (size_t)band->list[LIST_WORDS * index.each[lane] + 2];
        pixel[0] = (float)x.each[lane];
        pixel[1] = (float)y.each[lane];
        pixel[2] = (float)z.each[lane];
    }
}

// Records the uncertain lanes. A band sets bits, all of which were 0 before; a list adds to its pixels'
// counts, which follow its pixels. With `is_first` the counts start from 0.
static inline void film_flag_pixels(global int *flags, const Tile *tile, mask uncertain, bool is_first)
{
    if (!(IS_PIXEL_LIST && is_first) && !lanes_any(uncertain)) return;
    if (!IS_PIXEL_LIST) {
        uint first = tile->number * LANES;
        atomic_or(&flags[first >> 5], (int)(lanes_bits(uncertain & tile->inside) << (first & 31)));
        return;
    }
    flags += LIST_WORDS * (size_t)tile->width;
    IntegerLanes counted = {uncertain}, inside = {tile->inside}, index = {tile_index(tile)};
    for (uint lane = 0; lane < LANES; lane++) {
        if (!inside.each[lane]) continue;
        int before = is_first ? 0 : flags[index.each[lane]];
        flags[index.each[lane]] = before + (counted.each[lane] != 0);
    }
}

// Adds to a sum, whose rounding error `lost` the next addition compensates (Kahan, Further remarks on
// reducing truncation errors, CACM 8(1), 1965). A plain sum of a million equal samples would be off by 1 %.
static inline void compensated_add(Vector *sum, Vector *lost, Vector added)
{
    added = vector_subtract(added, *lost);
    Vector next = vector_add(*sum, added);
    *lost = vector_subtract(vector_subtract(next, *sum), added);
    *sum = next;
}

static inline Vector film_load_color(global const scalar *film, const Tile *tile)
{
    VectorLanes colors = vector_lanes_zero();
    IntegerLanes inside = {tile->inside}, index = {tile_index(tile)};
    for (uint lane = 0; lane < LANES; lane++) {
        global const scalar *pixel = film + (size_t)index.each[lane] * 3;
        if (inside.each[lane]) vector_lanes_set(&colors, lane, (scalar4)(pixel[0], pixel[1], pixel[2], 0));
    }
    return vector_of_lanes(&colors);
}

#endif
