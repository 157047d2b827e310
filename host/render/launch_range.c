#include "host/render/launch_range.h"

// Returns the size of a work-item's macro-tile in pixels.
static TileShape item_shape(uint32_t lanes)
{
    const uint32_t width = TILE_WIDTH_OF(lanes), height = TILE_HEIGHT_OF(lanes);
    return (TileShape){width * MACRO_TILE_COLUMNS_OF(lanes), height * MACRO_TILE_ROWS_OF(lanes)};
}

// Returns the preferred size of a work-group in work-items, which is that of --work-group if given. The
// device's limits are applied later. Square groups are coherent, since neighboring pixels hit the same
// objects. A work-item that renders whole tiles is alone in its group, because PoCL places the private
// variables of a group's items next to each other. 64 sets of them, each with the rays waiting behind glass,
// would exceed the cache.
static TileShape group_items(const Pass *pass)
{
    const Device *device = pass->compute->device;
    const size_t *fixed = device->work_group;
    if (fixed[0] > 0) return (TileShape){(uint32_t)fixed[0], (uint32_t)fixed[1]};
    const bool on_cpu = device->type & CL_DEVICE_TYPE_CPU;
    const uint32_t side = pass->lanes > 1 && on_cpu ? 1 : 8;
    return (TileShape){side, side};
}

TileShape group_shape(const Pass *pass)
{
    const TileShape item = item_shape(pass->lanes);
    const TileShape group = group_items(pass);
    return (TileShape){item.width * group.width, item.height * group.height};
}

static size_t divide_up(size_t count, size_t by)
{
    return (count + by - 1) / by; // NOLINT(clang-analyzer-core.UndefinedBinaryOperatorResult): by > 0
}

LaunchRange launch_range_of_rows(const Pass *pass, BandRows rows)
{
    const RenderSettings *settings = &pass->settings;
    const TileShape item = item_shape(pass->lanes);
    const TileShape group = group_items(pass);
    return (LaunchRange){
        .band = {{settings->region_x, settings->region_y + rows.first_row * settings_cell(settings),
                  settings->region_width, rows.row_count}},
        .item = item,
        .items = {divide_up(settings->region_width, item.width), divide_up(rows.row_count, item.height)},
        .group = {group.width, group.height}};
}

LaunchRange launch_range_of_list(const Pass *pass, uint32_t count)
{
    const uint32_t of_item = pass->lanes * pass->lanes;
    const TileShape group = group_items(pass);
    return (LaunchRange){.band = {{0, 0, count, 1}},
                         .item = {of_item, 1},
                         .items = {divide_up(count, of_item), 1},
                         .group = {(size_t)group.width * group.height, 1}};
}

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

// Returns how many of the `left` groups are next, at most `most`. The last two parts are about equal, since a
// small launch would slow the growth of the launches that follow.
static size_t groups_of_part(size_t most, size_t left)
{
    return left <= most ? left : left < 2 * most ? (left + 1) / 2 : most;
}

bool launch_range_next(LaunchRange *part, const LaunchRange *whole, uint64_t pixels_max)
{
    const size_t *group = whole->group, *items = whole->items;
    size_t column = part->first[0] + part->items[0], row = part->first[1];
    if (column >= items[0]) {
        column = 0;
        row += part->items[1];
    }
    if (row >= items[1]) return false;
    *part = *whole;
    // groups at the edges reach beyond the film
    if (row == 0 && column == 0 && launch_range_pixels(whole) <= pixels_max) return true;
    const size_t group_pixels = group[0] * group[1] * whole->item.width * whole->item.height;
    const size_t most = pixels_max > group_pixels ? (size_t)(pixels_max / group_pixels) : 1;
    const size_t row_groups = divide_up(items[0], group[0]);
    const size_t groups_right = divide_up(items[0] - column, group[0]);
    const size_t rows_below = divide_up(items[1] - row, group[1]);
    const bool has_whole_rows = column == 0 && most >= row_groups;
    const size_t columns = has_whole_rows ? row_groups : groups_of_part(most, groups_right);
    const size_t rows = has_whole_rows ? groups_of_part(most / row_groups, rows_below) : 1;
    part->first[0] = column;
    part->first[1] = row;
    part->items[0] = least(columns * group[0], items[0] - column);
    part->items[1] = least(rows * group[1], items[1] - row);
    return true;
}

uint64_t launch_range_pixels(const LaunchRange *range)
{
    const size_t left = range->first[0] * range->item.width, top = range->first[1] * range->item.height;
    const uint64_t width = least(range->items[0] * range->item.width, range->band.s[2] - left);
    return width * least(range->items[1] * range->item.height, range->band.s[3] - top);
}

size_t launch_range_flag_words(const LaunchRange *range)
{
    return divide_up(range->items[0] * range->items[1] * range->item.width * range->item.height, 32);
}
