#include "host/import/place.h"

#include "host/base/array.h"
#include "host/base/text.h"

#include <stdlib.h>

Places places_open(const Source *source)
{
    Places places = {.source_length = source->length};
    for (size_t i = 0; i < source->length; i++)
        if (text_ends_line(source->bytes + i, source->length - i)) array_push(places.line_starts, i + 1);
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
        scene->objects.items[places->object_count].line =
            offset > places->source_length ? 0 : (uint32_t)first + 1;
}
