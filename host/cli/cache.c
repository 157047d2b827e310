// glint cache lists and checks the kernel cache, or empties it.
#include "host/opencl/cache.h"
#include "host/base/exit_status.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/options.h"
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    bool clears;
} CacheOptions;

static const Option command_options[] = {
    {"clear", NULL, "remove all programs from the cache", option_flag, offsetof(CacheOptions, clears)}};

static const CommandLine command_line = {
    .command = "cache",
    .usage =
        "usage: glint cache [OPTIONS]\n\n"
        "Lists and checks the programs of the kernel cache, the least recently used first. Exit status: 0 "
        "all are used,\n"
        "3 one is damaged or not private.\n",
    .groups = {OPTIONS(command_options)}};

// Returns whether all entries can be trusted.
static bool entries_print(const CacheEntries *entries)
{
    bool trusted = true;
    for (size_t i = 0; i < entries->count; i++) {
        const CacheEntry *entry = &entries->items[i];
        char used[32] = "?";
        struct tm local;
        if (localtime_r(&entry->used.tv_sec, &local)) strftime(used, sizeof used, "%Y-%m-%d %H:%M", &local);
        const char *device = entry->device ? entry->device : "(another version of glint)";
        printf("  %s  %10s  %s  %s%s\n", entry->name, text_size((double)entry->size).text, used,
               entry->fault ? "not used: " : "", entry->fault ? entry->fault : device);
        trusted = trusted && !entry->fault;
    }
    return trusted;
}

static int cache_print(const char *folder)
{
    PrintedMessages messages = {0};
    CacheEntries entries;
    if (!cache_list(&entries, &messages)) return EXIT_USER;
    printf("%s: %zu program%s, %s of at most %s\n", folder, entries.count, text_plural(entries.count),
           text_size((double)entries.size).text, text_size(CACHE_BYTES_MAX).text);
    const bool are_trusted = entries_print(&entries);
    cache_entries_free(&entries);
    return are_trusted ? EXIT_DONE : EXIT_CHECK;
}

int command_cache(int argument_count, char **arguments)
{
    CacheOptions options = {0};
    const int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    OWNED char *folder = cache_folder_path();
    if (!folder) {
        stderr_print("there is no kernel cache: neither XDG_CACHE_HOME nor HOME is an absolute path");
        return EXIT_USER;
    }
    if (!options.clears) return cache_print(folder);
    PrintedMessages messages = {0};
    return cache_clear(&messages) ? EXIT_DONE : EXIT_USER;
}
