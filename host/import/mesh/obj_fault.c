// Locates an error in an OBJ file: assimp names no line, and it renumbers the vertices.
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/import/line.h"
#include "host/import/mesh/mesh_import.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

typedef struct {
    Line line;
    size_t line_number, vertex_count, all_vertex_count;
    const bool *used; // by a face; each vertex, from 1
    bool unused_too;  // check the other vertices too
    char *fault;
    size_t size;
} Search;

static bool vertex_is_faulty(Search *search)
{
    for (int axis = 0; axis < 3; axis++) {
        Word word = line_word(&search->line);
        double value;
        NumberStatus status = number_read(word.text, word.length, &value);
        if (status == NUMBER_READ) continue;
        const char *what = word.length == 0             ? "is missing"
                           : status == NUMBER_TOO_LARGE ? "is too large"
                                                        : "is not a finite number";
        snprintf(search->fault, search->size, "line %zu: vertex %zu: '%.*s' for %c %s", search->line_number,
                 search->vertex_count, word_shown(word), word.text, "xyz"[axis], what);
        return true;
    }
    return false;
}

// 1-based; 0 if there is no such vertex. A negative index counts back from the last vertex before the face.
static size_t vertex_of(Word word, size_t vertex_count, size_t all_vertex_count)
{
    long long index = strtoll(word.text, NULL, 10);
    long long counted = index < 0 ? (long long)vertex_count + 1 + index : index;
    return counted >= 1 && counted <= (long long)all_vertex_count ? (size_t)counted : 0;
}

static bool face_is_faulty(Search *search)
{
    for (Word word = line_word(&search->line); word.length > 0; word = line_word(&search->line)) {
        if (vertex_of(word, search->vertex_count, search->all_vertex_count)) continue;
        snprintf(search->fault, search->size, "line %zu: a face names vertex '%.*s'; there are %zu",
                 search->line_number, word_shown(word), word.text, search->all_vertex_count);
        return true;
    }
    return false;
}

static size_t vertices_count(Line line)
{
    size_t count = 0;
    while (line_next(&line, '#'))
        count += word_is(line_word(&line), "v");
    return count;
}

static void used_mark(bool *used, Line line, size_t all_vertex_count)
{
    size_t vertex_count = 0;
    while (line_next(&line, '#')) {
        Word keyword = line_word(&line);
        vertex_count += word_is(keyword, "v");
        if (!word_is(keyword, "f")) continue;
        for (Word word = line_word(&line); word.length > 0; word = line_word(&line))
            used[vertex_of(word, vertex_count, all_vertex_count)] = true;
    }
}

static bool lines_search(Search search)
{
    while (line_next(&search.line, '#')) {
        search.line_number++;
        Word keyword = line_word(&search.line);
        if (word_is(keyword, "v")) {
            search.vertex_count++;
            bool counts = search.unused_too || search.used[search.vertex_count];
            if (counts && vertex_is_faulty(&search)) return true;
        } else if (word_is(keyword, "f") && face_is_faulty(&search)) {
            return true;
        }
    }
    return false;
}

// A vertex that no face uses is reported only if nothing else is wrong.
static bool fault_search(Search *search)
{
    search->all_vertex_count = vertices_count(search->line);
    bool *used = memory_allocate_zeroed(search->all_vertex_count + 1, sizeof *used);
    used_mark(used, search->line, search->all_vertex_count);
    search->used = used;
    bool found = lines_search(*search);
    search->unused_too = true;
    found = found || lines_search(*search);
    free(used);
    return found;
}

bool obj_find_fault(const char *path, char *fault, size_t size)
{
    size_t length = strlen(path);
    if (length < 4 || strcasecmp(path + length - 4, ".obj") != 0) return false;
    MessageList messages = {0};
    Text text = {0};
    bool found = false;
    if (text_read_file(&text, path, &messages)) {
        Source source = {.file = path, .bytes = text_c(&text), .length = text.count};
        Report report = report_open(&source, &messages);
        Search search = {.fault = fault, .size = size};
        if (line_open(&search.line, &report))
            found = fault_search(&search);
        else
            found = snprintf(fault, size, "not text: a NUL character") > 0;
    }
    text_free(&text);
    message_list_free(&messages);
    return found;
}

static bool is_readable(const char *folder, size_t folder_length, const char *name)
{
    Text path = {0};
    text_append(&path, folder, folder_length);
    text_appendf(&path, "%s", name);
    bool readable = access(text_c(&path), R_OK) == 0;
    text_free(&path);
    return readable;
}

bool obj_find_missing_material_file(const char *path, char *name, size_t size)
{
    size_t length = strlen(path);
    FILE *file = length < 4 || strcasecmp(path + length - 4, ".obj") != 0 ? NULL : fopen(path, "rbe");
    if (!file) return false;
    const char *slash = strrchr(path, '/');
    size_t folder_length = slash ? (size_t)(slash + 1 - path) : 0;
    char *line = NULL;
    size_t capacity = 0;
    bool found = false;
    while (!found && getline(&line, &capacity, file) > 0) {
        static const char keyword[] = "mtllib";
        const char *start = line + strspn(line, " \t");
        if (strncmp(start, keyword, strlen(keyword)) != 0) continue;
        start += strlen(keyword) + strspn(start + strlen(keyword), " \t");
        snprintf(name, size, "%.*s", (int)strcspn(start, "\r\n"), start);
        found = name[0] != '\0' && !is_readable(path, name[0] == '/' ? 0 : folder_length, name);
    }
    free(line);
    fclose(file);
    Text fallback = {0};
    text_append(&fallback, path, length - strlen("obj"));
    text_appendf(&fallback, "mtl");
    found = found && access(text_c(&fallback), R_OK) != 0;
    text_free(&fallback);
    return found;
}
