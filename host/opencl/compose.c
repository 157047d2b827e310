// Expands the includes of a kernel file into one text.
#include "host/opencl/compose.h"

#include "host/base/memory.h"
#include "host/base/text.h"
#include <stdlib.h>
#include <string.h>

typedef struct {
    const EmbeddedFile *files;
    bool *included; // per file
    Text text;
    char *missing;
} Composer;

// The file's name, without its folder, where the line is `#include "name"`, else false.
static bool include_name(const char *line, size_t length, const char **name, size_t *name_length)
{
    const char *at = line, *end = line + length;
    while (at < end && (*at == ' ' || *at == '\t'))
        at++;
    if (at == end || *at++ != '#') return false;
    while (at < end && (*at == ' ' || *at == '\t'))
        at++;
    static const char word[] = "include";
    const size_t word_length = sizeof word - 1;
    if ((size_t)(end - at) < word_length || memcmp(at, word, word_length) != 0) return false;
    at += word_length;
    while (at < end && (*at == ' ' || *at == '\t'))
        at++;
    if (at == end || *at++ != '"') return false;
    const char *quote = memchr(at, '"', (size_t)(end - at));
    if (!quote) return false;
    for (const char *slash = at; slash < quote; slash++)
        if (*slash == '/') at = slash + 1;
    *name = at;
    *name_length = (size_t)(quote - at);
    return true;
}

static bool compose_file(Composer *composer, const char *name, size_t name_length)
{
    size_t index = 0;
    const EmbeddedFile *file = composer->files;
    while (file->name && !(strlen(file->name) == name_length && memcmp(file->name, name, name_length) == 0))
        file++, index++;
    if (!file->name) {
        composer->missing = strndup(name, name_length);
        return false;
    }
    if (composer->included[index]) {
        text_append(&composer->text, "\n", 1);
        return true;
    }
    composer->included[index] = true;
    text_appendf(&composer->text, "#line 1 \"%s\"\n", file->name);
    unsigned line_number = 1;
    for (const char *line = file->text; *line != '\0'; line_number++) {
        size_t length = strcspn(line, "\n");
        const char *included;
        size_t included_length;
        if (include_name(line, length, &included, &included_length)) {
            if (!compose_file(composer, included, included_length)) return false;
            text_appendf(&composer->text, "#line %u \"%s\"\n", line_number + 1, file->name);
        } else {
            text_append(&composer->text, line, length);
            text_append(&composer->text, "\n", 1);
        }
        line += length + (line[length] == '\n');
    }
    return true;
}

char *kernel_compose(const EmbeddedFile *files, const char *root, const char *prelude, char **missing)
{
    size_t file_count = 0;
    while (files[file_count].name)
        file_count++;
    Composer composer = {.files = files, .included = memory_allocate_zeroed(file_count + 1, sizeof(bool))};
    text_appendf(&composer.text, "#line 1 \"prelude\"\n%s\n", prelude);
    char *composed = NULL;
    if (compose_file(&composer, root, strlen(root))) composed = memory_copy_text(text_c(&composer.text));
    if (missing)
        *missing = composer.missing;
    else
        free(composer.missing);
    text_free(&composer.text);
    free(composer.included);
    return composed;
}

char *program_text(const char *root, const char *prelude)
{
    return kernel_compose(kernel_files, root, prelude, NULL);
}
