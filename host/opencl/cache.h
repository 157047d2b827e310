// Caches compiled programs on disk in $XDG_CACHE_HOME/glint or, without that variable, in $HOME/.cache/glint.
// A path that is not absolute is ignored, as the XDG Base Directory Specification requires (0.8, "Basics");
// without either there is no cache. An entry is named by the hash of its key and contains the whole key, so
// that keys are never confused. Many processes can use the cache, because entries are written to a temporary
// and renamed. Entries are machine code. The folder and its files are used only if they belong to the user
// and nobody else may access them, and an entry only if its hash (BLAKE2b) is right. No function fails
// because of an entry. An untrusted entry counts as absent, with one warning per receiver, and is replaced if
// the folder can be trusted. An entry that cannot be written is discarded.
#pragma once

#include "host/base/text.h"
#include "host/opencl/device.h"
#include <stdint.h>
#include <time.h>

// Loads the key's entry into `binary`, which must be empty. Returns false if no trusted entry exists.
// `warnings` may be NULL in all functions.
bool cache_load(const char *key, Text *binary, WarningReceiver *warnings);
// Replaces the key's entry, and removes the least recently used ones beyond CACHE_BYTES_MAX. An entry above
// CACHE_ENTRY_BYTES_MAX is discarded.
void cache_store(const char *key, const Text *binary, WarningReceiver *warnings);

enum { CACHE_BYTES_MAX = 128 << 20, CACHE_ENTRY_BYTES_MAX = 32 << 20 }; // several hundred programs

typedef struct {
    char *name;        // of the file
    char *device;      // from the entry's key, or NULL with a fault or if another version of glint wrote it
    const char *fault; // why the entry is not trusted, or NULL if it is
    uint64_t size;
    struct timespec used;
} CacheEntry;

typedef struct {
    CacheEntry *items; // the least recently used first
    size_t count, capacity;
    uint64_t size;
} CacheEntries;

// Lists and checks all entries. The list is empty if there is no folder. Returns false with a message if the
// folder cannot be trusted or read.
bool cache_list(CacheEntries *entries, MessageList *messages);
void cache_entries_free(CacheEntries *entries);
// Removes all entries. Returns false with a message if the folder cannot be trusted or read, or an entry
// cannot be removed.
bool cache_clear(MessageList *messages);

// Return the cache's folder and the path of the key's entry, or NULL without a cache. The caller frees them.
char *cache_folder_path(void);
char *cache_entry_path(const char *key);
