// What files that outlive their process, or that others name, need: locks, names and syncs.
#pragma once

#include <stdbool.h>

// FILE_REMOVED: the lock is held, but of a file that lost its last name before.
typedef enum { FILE_LOCKED, FILE_BUSY, FILE_REMOVED } FileLock;

// Locks an open file until it is closed, without waiting. A file system without locks counts as locked.
FileLock file_lock(int descriptor);
// Whether the name in the open folder (or AT_FDCWD) is that of the open file, and not of another one or a
// symbolic link.
bool file_has_name(int descriptor, int folder, const char *name);
// Opens the folder of a file. One that may be written but not listed is opened, but cannot be synced. -1: see
// errno.
int file_folder_open(const char *path);
// What keeps a file that another one names from being read, or NULL: a pipe might wait, a device never end.
const char *file_obstacle(const char *path);
// Syncs a file or folder. False where a write failed; not every file system can sync every file, which is no
// failure.
bool file_sync(int descriptor);
