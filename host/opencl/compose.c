// Expands the includes of a kernel file into one text.
#include "host/opencl/compose.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <stdlib.h>
#include <string.h>

typedef struct {
    const EmbeddedFile *files;
    bool *included; // per file
    Text text;
} Composer;

// Returns the length of the file's name, without its folder, if the line is `#include "name"`, otherwise 0.
static size_t include_name(const char *line, const char **name)
{
    static const char word[] = "include";
    const char *at = line + strspn(line, " \t");
    if (*at++ != '#') return 0;
    at += strspn(at, " \t");
    if (strncmp(at, word, sizeof word - 1) != 0) return 0;
    at += sizeof word - 1;
    at += strspn(at, " \t");
    if (*at++ != '"') return 0;
    const size_t length = strcspn(at, "\"\n");
    if (at[length] != '"') return 0;
    const char *slash = memrchr(at, '/', length);
    *name = slash ? slash + 1 : at;
    return (size_t)(at + length - *name);
}

static void compose_file(Composer *composer, const char *name, size_t name_length)
{
    size_t index = 0;
    const EmbeddedFile *file = composer->files;
    while (file->name && !(strlen(file->name) == name_length && memcmp(file->name, name, name_length) == 0))
        file++, index++;
    if (!file->name) fault("the kernel file %.*s is not embedded", (int)name_length, name);
    if (composer->included[index]) {
        text_append(&composer->text, "\n", 1);
        return;
    }
    composer->included[index] = true;
    text_appendf(&composer->text, "#line 1 \"%s\"\n", file->name);
    unsigned line_number = 1;
    for (const char *line = file->text; *line != '\0'; line_number++) {
        size_t length = strcspn(line, "\n");
        const char *included;
        const size_t included_length = include_name(line, &included);
        if (included_length > 0) {
            compose_file(composer, included, included_length);
            text_appendf(&composer->text, "#line %u \"%s\"\n", line_number + 1, file->name);
        } else {
            text_append(&composer->text, line, length);
            text_append(&composer->text, "\n", 1);
        }
        line += length + (line[length] == '\n');
    }
}

// Aligns double4 to 32 bytes, as OpenCL C 1.2 (section 6.1.5) requires and the host's structs, which have no
// longer vectors, expect. On ARM, clang aligns vectors to at most 16 bytes
// (github.com/pocl/pocl/issues/2174). PoCL's devices have the host's architecture; elsewhere the attribute
// changes nothing.
#if defined __aarch64__ || defined __arm__
static const char alignment_text[] = "#if IS_DOUBLE\n"
                                     "#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n"
                                     "typedef double4 aligned_double4 __attribute__((aligned(32)));\n"
                                     "#define double4 aligned_double4\n"
                                     "#endif\n";
#else
static const char alignment_text[] = "";
#endif

char *kernel_compose(const EmbeddedFile *files, const char *root, const char *prelude)
{
    size_t file_count = 0;
    while (files[file_count].name)
        file_count++;
    Composer composer = {.files = files, .included = memory_allocate_zeroed(file_count, sizeof(bool))};
    text_appendf(&composer.text, "#line 1 \"prelude\"\n%s\n%s", prelude, alignment_text);
    compose_file(&composer, root, strlen(root));
    free(composer.included);
    return composer.text.items;
}
