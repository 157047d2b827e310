#include "host/cli/report_scrub.h"

#include "host/base/memory.h"
#include <ctype.h>
#include <pwd.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>
#include <unistd.h>

static void word_add(Scrubber *scrubber, const char *word, const char *replacement, bool is_path)
{
    // a root folder or a name that every system has identifies nobody
    if (!word || strcmp(word, "root") == 0 || strcmp(word, "localhost") == 0) return;
    size_t length = strlen(word);
    while (is_path && length > 0 && word[length - 1] == '/')
        length--;
    if (length < 2) return;
    scrubber->words[scrubber->count].word = memory_copy_part(word, length);
    scrubber->words[scrubber->count].replacement = replacement;
    scrubber->words[scrubber->count++].is_path = is_path;
}

Scrubber scrubber_open(const char *folder)
{
    Scrubber scrubber = {0};
    const struct passwd *user = getpwuid(geteuid());
    struct utsname host = {0};
    uname(&host);
    word_add(&scrubber, folder, ".", true);
    word_add(&scrubber, getenv("HOME"), "~", true);
    if (user) word_add(&scrubber, user->pw_dir, "~", true);
    if (user) word_add(&scrubber, user->pw_name, "USER", false);
    word_add(&scrubber, getenv("USER"), "USER", false);
    word_add(&scrubber, getenv("LOGNAME"), "USER", false);
    word_add(&scrubber, host.nodename, "HOST", false);
    return scrubber;
}

void scrubber_close(Scrubber *scrubber)
{
    for (size_t i = 0; i < scrubber->count; i++)
        free(scrubber->words[i].word);
    *scrubber = (Scrubber){0};
}

// Returns whether a character belongs to a word. "+" does, so that the version 3.1+debian keeps its
// "debian", which is also a common host name.
static bool is_of_word(char character)
{
    return isalnum((unsigned char)character) || strchr("_+-", character);
}

static bool is_of_path(char character)
{
    return isalnum((unsigned char)character) || strchr("_+-.~@%/", character);
}

// Returns whether a path that has begun continues with the character. A byte beyond ASCII continues it, but a
// path may also follow one, which may be part of a quotation mark.
static bool continues_path(char character)
{
    return (unsigned char)character >= 0x80 || is_of_path(character);
}

// Returns whether a path may begin at a byte. It does after a character that paths lack, after the n of an
// escaped newline, or after an option's letter, as in -I/usr/include.
static bool path_may_begin(const Text *text, size_t at)
{
    if (at == 0) return true;
    const char *end = text->items + at;
    if (end[-1] == '\0' || !is_of_path(end[-1])) return true;
    return at > 1 && isalpha((unsigned char)end[-1]) &&
           (end[-2] == '\\' || (end[-2] == '-' && (at == 2 || !is_of_word(end[-3]))));
}

// Returns the length of the absolute path at a byte, or 0 if there is none.
static size_t path_length(const Text *text, size_t at)
{
    const char *path = text->items + at;
    if (path[0] != '/' || path[1] == '\0' || path[1] == '/' || !continues_path(path[1]) ||
        !path_may_begin(text, at))
        return 0;
    size_t length = 1;
    while (path[length] != '\0' && continues_path(path[length]))
        length++;
    return length;
}

// Appends PATH, and the name of a file in a folder below another one.
static void path_append(Text *to, const char *path, size_t length)
{
    size_t slashes = 0, name = 0;
    for (size_t i = 0; i < length; i++)
        if (path[i] == '/') {
            slashes++;
            name = i;
        }
    const bool has_ending = memchr(path + name, '.', length - name) != NULL;
    text_appendf(to, "PATH");
    if (slashes >= 3 && has_ending) text_append(to, path + name, length - name);
}

// Returns the index of the word at a byte, or the number of words if there is none.
static size_t word_find(const Scrubber *scrubber, const Text *text, size_t at)
{
    const char *here = text->items + at;
    for (size_t i = 0; i < scrubber->count; i++) {
        const size_t length = strlen(scrubber->words[i].word);
        if (length > text->count - at || memcmp(here, scrubber->words[i].word, length) != 0) continue;
        if (here[length] != '\0' && is_of_word(here[length])) continue;
        if (scrubber->words[i].is_path && (unsigned char)here[length] >= 0x80) continue;
        if (scrubber->words[i].is_path || at == 0 || here[-1] == '\0' || !is_of_word(here[-1])) return i;
    }
    return scrubber->count;
}

Text scrub(const Scrubber *scrubber, const Text *text)
{
    Text result = {0};
    for (size_t at = 0; at < text->count;) {
        const size_t word = word_find(scrubber, text, at), length = path_length(text, at);
        if (word < scrubber->count) {
            text_appendf(&result, "%s", scrubber->words[word].replacement);
            at += strlen(scrubber->words[word].word);
        } else if (length > 0) {
            path_append(&result, text->items + at, length);
            at += length;
        } else {
            text_append(&result, text->items + at++, 1);
        }
    }
    return result;
}
