// A band of the image: the pixels of each work-item, and where their values are stored.
#ifndef FILM_H
#define FILM_H

#include "camera.h"

typedef struct {
    uint first_x, first_y, width, height; // in the whole image; of a list its length and 1
    uint cell;                            // 1, or the side of the squares that have one pixel each
    global const uint *pixels;            // the list: x and y of each pixel in the whole image
} Band;

typedef struct {
    Pixels pixels;
    mask inside;
    integer index; // of each pixel within the band
    uint width;    // of the band
    uint number;   // of the tile, in the order of work-items
} Tile;

// Mixes 32 bits one to one: as alike as two numbers are, their results are unlike.
static inline uint bits_scramble(uint bits)
{
    bits = (bits ^ (bits >> 16)) * 0x45d9f3bu;
    bits = (bits ^ (bits >> 15)) * 0x2c1b3c6du;
    return bits ^ (bits >> 16);
}

// Of each square of cell x cell pixels, whose corner is given, one at a place that a hash chooses: a
// stratified sample of the image (host/measure/pilot.h). `down` is hashed of all 32 bits, of which `across`
// shows the first few.
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

// The work-item's tile number `which` of a list, with pixels from anywhere: of those that `certified` left in
// doubt.
static inline Tile list_tile(const Band *band, uint which)
{
    uint first = ((uint)get_global_id(0) * TILES + which) * LANES;
    if (get_global_id(1) > 0) first = band->width;
    IntegerLanes index, x, y, inside;
    for (uint lane = 0; lane < LANES; lane++) {
        uint at = min(first + lane, band->width - 1);
        inside.each[lane] = first + lane < band->width ? 1 : 0;
        index.each[lane] = at;
        x.each[lane] = band->pixels[2 * at];
        y.each[lane] = band->pixels[2 * at + 1];
    }
    Tile tile = {{x.all, y.all}, inside.all != (integer)(0), index.all, 0, 0};
    if (band->cell > 1) tile.pixels = pixels_scatter(tile.pixels, band->cell);
    return tile;
}

// The work-item's tile number `which`, from 0 to TILES - 1.
static inline Tile band_tile(const Band *band, uint which)
{
    if (IS_PIXEL_LIST) return list_tile(band, which);
    Tile tile;
    uint column = (uint)get_global_id(0) * MACRO_TILE_COLUMNS + which % MACRO_TILE_COLUMNS;
    uint row = (uint)get_global_id(1) * MACRO_TILE_ROWS + (which >> MACRO_TILE_COLUMNS_LOG2);
    integer x = (integer)((scalar_integer)(column * TILE_WIDTH)) + LANE_X;
    integer y = (integer)((scalar_integer)(row * TILE_HEIGHT)) + LANE_Y;
    tile.inside =
        (x < (integer)((scalar_integer)band->width)) & (y < (integer)((scalar_integer)band->height));
    tile.index = y * (integer)((scalar_integer)band->width) + x;
    tile.width = band->width;
    const uint item_width = MACRO_TILE_COLUMNS * TILE_WIDTH;
    const uint of_row = (band->width + item_width - 1) / item_width;
    tile.number = ((uint)get_global_id(1) * of_row + (uint)get_global_id(0)) * TILES + which;
    integer cell = (integer)((scalar_integer)band->cell);
    tile.pixels.x = x * cell + (integer)((scalar_integer)band->first_x);
    tile.pixels.y = y * cell + (integer)((scalar_integer)band->first_y);
    if (band->cell > 1) tile.pixels = pixels_scatter(tile.pixels, band->cell);
    return tile;
}

// Stores or loads one of `stride` values per pixel.
static inline void film_store(global scalar *film, const Tile *tile, uint stride, uint channel, real value)
{
    RealLanes values = {value};
    IntegerLanes inside = {tile->inside}, index = {tile->index};
    for (uint lane = 0; lane < LANES; lane++)
        if (inside.each[lane]) film[(size_t)index.each[lane] * stride + channel] = values.each[lane];
}

static inline void film_store_integer(global int *film, const Tile *tile, uint stride, uint channel,
                                      integer value)
{
    IntegerLanes values = {value}, inside = {tile->inside}, index = {tile->index};
    for (uint lane = 0; lane < LANES; lane++)
        if (inside.each[lane]) film[(size_t)index.each[lane] * stride + channel] = (int)values.each[lane];
}

#if TILE_WIDTH == 4
// Four neighboring pixels' colors, interleaved.
static inline void film_store_row(global scalar *film, scalar4 r, scalar4 g, scalar4 b)
{
    vstore4((scalar4)(r.x, g.x, b.x, r.y), 0, film);
    vstore4((scalar4)(g.y, b.y, r.z, g.z), 1, film);
    vstore4((scalar4)(b.z, r.w, g.w, b.w), 2, film);
}
#endif

static inline void film_store_color(global scalar *film, const Tile *tile, Vector color)
{
#if TILE_WIDTH == 4
    if (!IS_PIXEL_LIST && lanes_all(tile->inside)) {
        global scalar *row = film + (size_t)tile->index.s0 * 3;
        size_t next = (size_t)tile->width * 3;
#if LANES == 16
        film_store_row(row, color.x.s0123, color.y.s0123, color.z.s0123);
        film_store_row(row + next, color.x.s4567, color.y.s4567, color.z.s4567);
        film_store_row(row + 2 * next, color.x.s89ab, color.y.s89ab, color.z.s89ab);
        film_store_row(row + 3 * next, color.x.scdef, color.y.scdef, color.z.scdef);
#else
        film_store_row(row, color.x.lo, color.y.lo, color.z.lo);
        film_store_row(row + next, color.x.hi, color.y.hi, color.z.hi);
#endif
        return;
    }
#endif
    film_store(film, tile, 3, 0, color.x);
    film_store(film, tile, 3, 1, color.y);
    film_store(film, tile, 3, 2, color.z);
}

// Notes the lanes in doubt: in a word per tile, as bits; of a list in its pixels' counts. `is_first`:
// nothing has been noted there yet.
static inline void film_note_doubts(global int *doubts, const Tile *tile, mask doubt, bool is_first)
{
    if (!is_first && !lanes_any(doubt)) return;
    if (!IS_PIXEL_LIST) {
        int before = is_first ? 0 : doubts[tile->number];
        doubts[tile->number] = before | (int)lanes_bits(doubt & tile->inside);
        return;
    }
    IntegerLanes counted = {doubt}, inside = {tile->inside}, index = {tile->index};
    for (uint lane = 0; lane < LANES; lane++) {
        if (!inside.each[lane]) continue;
        int before = is_first ? 0 : doubts[index.each[lane]];
        doubts[index.each[lane]] = before + (counted.each[lane] != 0);
    }
}

static inline Vector film_load_color(global const scalar *film, const Tile *tile)
{
    RealLanes x = {(real)(0)}, y = x, z = x;
    IntegerLanes inside = {tile->inside}, index = {tile->index};
    for (uint lane = 0; lane < LANES; lane++) {
        if (!inside.each[lane]) continue;
        x.each[lane] = film[(size_t)index.each[lane] * 3];
        y.each[lane] = film[(size_t)index.each[lane] * 3 + 1];
        z.each[lane] = film[(size_t)index.each[lane] * 3 + 2];
    }
    return (Vector){x.all, y.all, z.all};
}

#endif
