// Locks, identifies and syncs files that outlive their process or that other files name.
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <unistd.h>

// Closes a descriptor unless it is negative. For OwnedDescriptor, which does so where its scope ends.
static inline void file_close(const int *descriptor)
{
    if (*descriptor >= 0) close(*descriptor);
}
#define OwnedDescriptor __attribute__((cleanup(file_close))) int

// FILE_REMOVED: the file is locked but had lost its last name before.
typedef enum { FILE_LOCKED, FILE_BUSY, FILE_REMOVED } FileLock;

// Locks an open file until it is closed, without waiting. If the file system has no locks, it counts as
// locked.
FileLock file_lock(int descriptor);
// Returns whether the name in the open folder (or AT_FDCWD) is that of the open file, and not of another file
// or a symbolic link.
bool file_has_name(int descriptor, int folder, const char *name);
// Identifies a file, under whatever name it is opened. It is zeroed for a missing file.
typedef struct {
    uint64_t device, index;
} FileId;

// Returns the identity of the file to which a path leads. The path may be NULL.
FileId file_id(const char *path);
// Returns whether both identities are those of one file, which is not missing.
bool file_is_same(FileId a, FileId b);
// Returns the part of a path after its last slash.
const char *file_base_name(const char *path);
// Returns the base name without its ending, or "image" for "-", standard input. The caller frees it.
char *file_stem(const char *path);
// Opens the folder of a file. A folder that may be written but not listed is opened, but cannot be synced.
// Returns -1 and sets errno on failure.
int file_folder_open(const char *path);
// Returns the reason why a file that another file names must not be read, or NULL. A pipe might block, and a
// device might never end.
const char *file_obstacle(const char *path);
// Syncs a file or folder. Returns false if a write failed. A file system that cannot sync the file is not a
// failure.
bool file_sync(int descriptor);
