// Compiled programs on disk, in $XDG_CACHE_HOME/glint, else $HOME/.cache/glint; a path that is not absolute
// is ignored, as the XDG Base Directory Specification requires (0.8, "Basics"); without either there is no
// cache. An entry is named by the hash of its key and contains the whole key, so that keys are never
// confused. Safe with many processes: entries are written beside their target and renamed. Nothing here is an
// error: what cannot be read is absent, what cannot be written is discarded.
#pragma once

#include "host/base/text.h"
#include <stdint.h>

// Fills `binary`, which must be empty. False without an entry; a damaged one, one of another user and one
// that is not a regular file are ignored.
bool cache_load(const char *key, Text *binary);
// Replaces the key's entry, and trims the cache to CACHE_BYTES_MAX.
void cache_store(const char *key, const Text *binary);

enum { CACHE_BYTES_MAX = 128 << 20 }; // several hundred programs
// Removes the least recently used entries until at most `bytes_max` are left.
void cache_trim(const char *folder, uint64_t bytes_max);

// The path of the key's entry, which the caller frees; NULL: no cache.
char *cache_entry_path(const char *key);
