#include "host/import/place.h"

#include "host/base/array.h"
#include <stdlib.h>
#include <string.h>

Places places_open(const Source *source)
{
    Places places = {0};
    const char *end = source->bytes + source->length;
    for (const char *at = source->bytes; at < end; at++) {
        at = memchr(at, '\n', (size_t)(end - at));
        if (!at) break;
        array_push(places.line_starts, (size_t)(at + 1 - source->bytes));
    }
    return places;
}

void places_close(Places *places)
{
    free(places->line_starts.items);
    *places = (Places){0};
}

void places_note(Places *places, Scene *scene, size_t offset)
{
    if (places->object_count == scene->objects.count) return;
    size_t first = 0, end = places->line_starts.count; // of the starts that may exceed the offset
    while (first < end) {
        const size_t middle = first + (end - first) / 2;
        if (places->line_starts.items[middle] <= offset)
            first = middle + 1;
        else
            end = middle;
    }
    for (; places->object_count < scene->objects.count; places->object_count++)
        scene->objects.items[places->object_count].line = (uint32_t)first + 1;
}
