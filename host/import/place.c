#include "host/import/place.h"

#include "host/base/array.h"
#include "host/base/text.h"

#include <stdlib.h>

Places places_open(const Source *source, const Source *end)
{
    Places places = {0};
    for (; source != end; source = source->next) {
        array_push(places.file_starts, places.end);
        array_push(places.file_lines, places.line_starts.count);
        array_push(places.line_starts, places.end);
        for (size_t i = 0; i < source->length; i++)
            if (text_ends_line(source->bytes + i, source->length - i))
                array_push(places.line_starts, places.end + i + 1);
        places.end += source->length + 1;
    }
    return places;
}

void places_close(Places *places)
{
    free(places->line_starts.items);
    free(places->file_starts.items);
    free(places->file_lines.items);
    *places = (Places){0};
}

// Returns how many of the offsets are at most `offset`.
static size_t offsets_up_to(const Offsets *offsets, size_t offset)
{
    size_t first = 0, end = offsets->count; // of those that may exceed it
    while (first < end) {
        const size_t middle = first + (end - first) / 2;
        if (offsets->items[middle] <= offset)
            first = middle + 1;
        else
            end = middle;
    }
    return first;
}

void places_record(Places *places, Scene *scene, size_t offset)
{
    if (places->object_count == scene->objects.count) return;
    uint32_t file = 0, line = 0;
    if (offset < places->end) {
        file = (uint32_t)offsets_up_to(&places->file_starts, offset) - 1;
        line = (uint32_t)(offsets_up_to(&places->line_starts, offset) - places->file_lines.items[file]);
    }
    for (; places->object_count < scene->objects.count; places->object_count++) {
        Object *object = &scene->objects.items[places->object_count];
        object->file = file;
        object->line = line;
    }
}
