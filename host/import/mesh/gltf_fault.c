// What assimp does not survive in a glTF file: it descends into lists and nodes by recursion and copies a
// node for each reference to it. The format allows a node one parent (glTF 2.0, 3.5.2).
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/import/mesh/mesh_import.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { LIST_DEPTH_MAX = 64, NODE_DEPTH_MAX = 1000, NODES_MAX = 1000000 };

static const size_t none = SIZE_MAX;

typedef struct {
    size_t from, to;
} Link;

typedef struct {
    Link *items;
    size_t count, capacity;
} Links;

typedef enum { KEY_OTHER, KEY_ESCAPED, KEY_NODES, KEY_SCENES, KEY_CHILDREN } Key;

// The JSON is read up to its first error, which assimp rejects.
typedef struct {
    const char *at, *end;
    size_t depth;                     // of nested lists and objects
    size_t index[LIST_DEPTH_MAX + 1]; // current item at each depth
    Key key[LIST_DEPTH_MAX + 1];      // last key at each depth
    size_t node_count;
    Links children, scene_nodes;
    char *fault;
    size_t size;
} Search;

static Key key_of(const char *text, size_t length)
{
    static const struct {
        const char *name;
        Key key;
    } keys[] = {{"nodes", KEY_NODES}, {"scenes", KEY_SCENES}, {"children", KEY_CHILDREN}};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        if (strlen(keys[i].name) == length && !memcmp(keys[i].name, text, length)) return keys[i].key;
    return memchr(text, '\\', length) ? KEY_ESCAPED : KEY_OTHER;
}

static char next_character(const Search *search)
{
    const char *at = search->at;
    while (at < search->end && strchr(" \t\r\n", *at))
        at++;
    return at < search->end ? *at : '\0';
}

// None of the relevant keys needs an escape.
static bool string_is_faulty(Search *search)
{
    const char *text = search->at;
    while (search->at < search->end && *search->at != '"')
        search->at += *search->at == '\\' ? 2 : 1;
    if (search->at >= search->end) return false;
    size_t length = (size_t)(search->at++ - text);
    if (next_character(search) != ':') return false;
    Key key = search->key[search->depth] = key_of(text, length);
    if (key != KEY_ESCAPED || (search->depth != 1 && search->depth != 3)) return false;
    return snprintf(search->fault, search->size, "the key '%.*s' is not a plain word",
                    length < 40 ? (int)length : 40, text) > 0;
}

static bool opening_is_faulty(Search *search, char bracket)
{
    if (search->depth == LIST_DEPTH_MAX)
        return snprintf(search->fault, search->size, "lists and objects are nested more than %d deep",
                        LIST_DEPTH_MAX) > 0;
    search->depth++;
    search->index[search->depth] = 0;
    search->key[search->depth] = KEY_OTHER;
    if (search->key[1] != KEY_NODES || bracket != '{') return false;
    if (search->depth == 2) return snprintf(search->fault, search->size, "glTF 1.0, not 2.0") > 0;
    if (search->depth == 3 && search->index[2] >= search->node_count)
        search->node_count = search->index[2] + 1;
    return false;
}

static void number_note(Search *search)
{
    size_t number = 0;
    for (; search->at < search->end && *search->at >= '0' && *search->at <= '9'; search->at++)
        number = number < SIZE_MAX / 20 ? 10 * number + (size_t)(*search->at - '0') : number;
    const Key *key = search->key;
    if (search->depth != 4) return;
    Link link = {search->index[2], number};
    if (key[1] == KEY_NODES && key[3] == KEY_CHILDREN) array_push(search->children, link);
    if (key[1] == KEY_SCENES && key[3] == KEY_NODES) array_push(search->scene_nodes, link);
}

static bool json_is_faulty(Search *search)
{
    while (search->at < search->end) {
        char character = *search->at;
        if (character >= '0' && character <= '9') {
            number_note(search);
            continue;
        }
        search->at++;
        if (character == '"' && string_is_faulty(search)) return true;
        if ((character == '{' || character == '[') && opening_is_faulty(search, character)) return true;
        if ((character == '}' || character == ']') && search->depth > 0) search->depth--;
        if (character == ',') search->index[search->depth]++;
    }
    return false;
}

// A scene instantiates each node once per reference to it or to one of its ancestors.
static bool tree_is_faulty(Search *search, const size_t *parents, const size_t *named)
{
    size_t placed_count = 0;
    for (size_t node = 0; node < search->node_count; node++) {
        size_t depth = 0;
        for (size_t above = node; above != none; above = parents[above]) {
            placed_count += named[above];
            if (++depth > NODE_DEPTH_MAX)
                return snprintf(search->fault, search->size,
                                "nodes are nested more than %d deep, or in a circle", NODE_DEPTH_MAX) > 0;
        }
        if (placed_count > NODES_MAX)
            return snprintf(search->fault, search->size, "more than %d nodes, with those placed again",
                            NODES_MAX) > 0;
    }
    return false;
}

// assimp rejects references to missing nodes.
static bool nodes_are_faulty(Search *search)
{
    size_t *parents = memory_allocate(search->node_count + 1, sizeof *parents);
    size_t *named = memory_allocate_zeroed(search->node_count + 1, sizeof *named);
    memset(parents, 0xff, search->node_count * sizeof *parents);
    bool faulty = false;
    for (size_t i = 0; i < search->children.count && !faulty; i++) {
        Link link = search->children.items[i];
        if (link.to >= search->node_count) continue;
        faulty = parents[link.to] != none;
        if (faulty) snprintf(search->fault, search->size, "node %zu (from 0) is a child twice", link.to);
        parents[link.to] = link.from;
    }
    for (size_t i = 0; i < search->scene_nodes.count; i++)
        if (search->scene_nodes.items[i].to < search->node_count) named[search->scene_nodes.items[i].to]++;
    faulty = faulty || tree_is_faulty(search, parents, named);
    free(parents);
    free(named);
    return faulty;
}

// The whole file, or the JSON chunk of a binary one: its length is at byte 12, its text at byte 20.
static bool json_read(Text *json, const char *path, bool binary)
{
    FILE *file = fopen(path, "rb");
    if (!file) return false;
    unsigned char head[20];
    size_t left = SIZE_MAX;
    bool read = !binary || fread(head, sizeof head, 1, file) == 1;
    if (read && binary)
        left = head[12] | (size_t)head[13] << 8 | (size_t)head[14] << 16 | (size_t)head[15] << 24;
    char bytes[1 << 14];
    for (size_t count = 1; read && left > 0 && count > 0; left -= count) {
        count = fread(bytes, 1, left < sizeof bytes ? left : sizeof bytes, file);
        text_append(json, bytes, count);
    }
    fclose(file);
    return read;
}

bool gltf_find_fault(const char *path, char *fault, size_t size)
{
    const char *ending = strrchr(path, '.');
    bool binary = ending && !strcasecmp(ending, ".glb");
    if (!binary && (!ending || strcasecmp(ending, ".gltf") != 0)) return false;
    Text json = {0};
    bool faulty = false;
    if (json_read(&json, path, binary)) {
        Search search = {.at = text_c(&json), .end = text_c(&json) + json.count, .size = size};
        search.fault = fault;
        faulty = json_is_faulty(&search) || nodes_are_faulty(&search);
        free(search.children.items);
        free(search.scene_nodes.items);
    }
    text_free(&json);
    return faulty;
}
