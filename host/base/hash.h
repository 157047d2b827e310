// FNV-1a, 64 bits (Fowler, Noll, Vo; draft-eastlake-fnv).
#pragma once

#include <stddef.h>
#include <stdint.h>

// Hashes bytes. Start with HASH_START, and chain by passing the last hash.
#define HASH_START UINT64_C(0xcbf29ce484222325)
uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t length);
