// Growing arrays: `Item *items; size_t count, capacity;` beside one another in a struct.
#pragma once

#include <stddef.h>

// Room for `extra` more items, doubling. `array` is an lvalue of a struct with items, count, capacity.
#define array_reserve(array, extra)                                                                          \
    ((array).count + (extra) <= (array).capacity                                                             \
         ? (void)0                                                                                           \
         : (void)((array).items = array_grow((array).items, &(array).capacity, (array).count + (extra),      \
                                             sizeof *(array).items)))

#define array_push(array, item) (array_reserve(array, 1), (void)((array).items[(array).count++] = (item)))

// Grows to at least `needed` items of `size` bytes and updates the capacity. Never returns NULL.
void *array_grow(void *items, size_t *capacity, size_t needed, size_t size);
