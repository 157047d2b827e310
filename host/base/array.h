// The size of an array, and growing arrays.
#pragma once

#include <stddef.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

// A growing array, which is empty if it is zeroed. Any struct with these members can be used as one, for
// example a struct with an anonymous ARRAY_OF member.
#define ARRAY_OF(Item)                                                                                       \
    struct {                                                                                                 \
        Item *items;                                                                                         \
        size_t count, capacity;                                                                              \
    }

// Ensures capacity for `extra` more items by doubling. `array` is an lvalue of such a struct.
#define array_reserve(array, extra)                                                                          \
    ((array).count + (extra) <= (array).capacity                                                             \
         ? (void)0                                                                                           \
         : (void)((array).items = array_grow((array).items, &(array).capacity, (array).count + (extra),      \
                                             sizeof *(array).items)))

#define array_push(array, item) (array_reserve(array, 1), (void)((array).items[(array).count++] = (item)))

// Reallocates to at least `needed` items of `size` bytes and updates the capacity. Never returns NULL.
void *array_grow(void *items, size_t *capacity, size_t needed, size_t size);
