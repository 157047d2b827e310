// Removes text that would identify the author and machine of a bug report: folders, and the names of user
// and host.
#pragma once

#include "host/base/text.h"

enum { SCRUB_WORDS_MAX = 8 };

// The words to replace, if no character of a word follows. A name must also not follow one.
typedef struct {
    struct {
        char *word;
        const char *replacement;
        bool is_path;
    } words[SCRUB_WORDS_MAX];
    size_t count;
} Scrubber;

// Finds the words, which are the folder, the home folders, and the names of the user and the host.
Scrubber scrubber_open(const char *folder);
void scrubber_close(Scrubber *scrubber);
// Returns the text with these words replaced, and with PATH instead of every other absolute path. The name of
// a file is kept if it has an ending and is at least three levels deep. The caller frees the text.
Text scrub(const Scrubber *scrubber, const Text *text);
