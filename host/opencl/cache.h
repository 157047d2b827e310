// Compiled programs on disk, in $XDG_CACHE_HOME/glint, else $HOME/.cache/glint; a path that is not absolute
// is ignored, as the XDG Base Directory Specification (0.8, "Basics") has it; neither: no cache. An entry is
// found by the hash of its key and holds the whole key, so that no two keys are ever taken for one another.
// Many processes may use it at once: entries are written beside and renamed. Nothing here is an error to
// anyone: what cannot be read is not there, what cannot be written is not kept.
#pragma once

#include "host/base/text.h"
#include <stdint.h>

// Fills `binary`, which must be empty. False if there is no entry; one that is damaged, no regular file or
// another user's is none.
bool cache_load(const char *key, Text *binary);
// Replaces the key's entry, and trims the cache to CACHE_BYTES_LARGEST.
void cache_store(const char *key, const Text *binary);

enum { CACHE_BYTES_LARGEST = 128 << 20 }; // several hundred programs
// Removes what has not been used for the longest time, until no more than that is left.
void cache_trim(const char *folder, uint64_t bytes_largest);

// The path of the key's entry, to be freed by the caller; NULL: no cache.
char *cache_entry_path(const char *key);
