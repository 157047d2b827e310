// Reads `include` of YAML scenes.
#include "host/base/array.h"
#include "host/base/file.h"
#include "host/base/hash.h"
#include "host/base/memory.h"
#include "host/import/yaml/yaml.h"

#include <stdlib.h>
#include <string.h>

// Bounds the number of included files, and so the depth of their includes.
enum { FILES_MAX = 100 };

typedef struct {
    FileId file;
    bool is_open; // its own includes are being read
} KnownFile;

typedef struct {
    YamlReader *reader;
    YamlTree *tree; // of the reader
    Source *last;   // source of the latest file
    size_t base;    // base of the next file's offsets
    // The first is the scene's.
    KnownFile files[1 + FILES_MAX];
    size_t file_count;
    bool is_full; // more than FILES_MAX were named
} Includes;

// The keys of a scene that an included file may have. Lists and mappings are joined. A YAML_SCALAR stands for
// any value, which applies only if the scene has none.
static const struct {
    const char *name;
    YamlType type;
} sections[] = {
    {"camera", YAML_SCALAR},    {"background", YAML_SCALAR}, {"frames", YAML_SCALAR},
    {"fps", YAML_SCALAR},       {"shutter", YAML_SCALAR},    {"ambient", YAML_SCALAR},
    {"lights", YAML_SEQUENCE},  {"materials", YAML_MAPPING}, {"define", YAML_MAPPING},
    {"objects", YAML_SEQUENCE},
};
enum { SECTION_COUNT = COUNT_OF(sections) };

// A mapping to which included files are added.
typedef struct {
    uint32_t root, last;            // child
    uint32_t values[SECTION_COUNT]; // 0: it has none
    uint32_t joined[SECTION_COUNT]; // the last child that came from a file; 0: none did
} Joined;

// Returns the index of the section that a key names, or SECTION_COUNT.
static size_t section_of(const Includes *includes, uint32_t key)
{
    return name_find(NAMES_OF(sections), yaml_text(includes->tree, yaml_node(includes->tree, key)));
}

static Joined joined_open(const Includes *includes, uint32_t root)
{
    Joined joined = {.root = root};
    for (uint32_t key = yaml_node(includes->tree, root)->first; key > 0;) {
        const uint32_t value = yaml_node(includes->tree, key)->next;
        const size_t section = section_of(includes, key);
        if (section < SECTION_COUNT && joined.values[section] == 0) joined.values[section] = value;
        joined.last = value;
        key = yaml_node(includes->tree, value)->next;
    }
    return joined;
}

// Appends a key and its value to the mapping.
static void joined_append(const Includes *includes, Joined *joined, uint32_t key)
{
    YamlNode *root = yaml_node(includes->tree, joined->root);
    const uint32_t value = yaml_node(includes->tree, key)->next;
    *(joined->last > 0 ? &yaml_node(includes->tree, joined->last)->next : &root->first) = key;
    yaml_node(includes->tree, value)->next = 0;
    root->child_count += 2;
    joined->last = value;
}

// Returns the last child of a nonempty collection.
static uint32_t last_child(const Includes *includes, uint32_t node)
{
    uint32_t last = yaml_node(includes->tree, node)->first;
    for (uint32_t child = last; child > 0; child = yaml_node(includes->tree, child)->next)
        last = child;
    return last;
}

// Adds the children of an included collection to the mapping's collection, after those of earlier files and
// before the mapping's.
static void children_join(const Includes *includes, Joined *joined, size_t section, uint32_t from)
{
    if (yaml_node(includes->tree, from)->child_count == 0) return;
    yaml_children_unshare(includes->tree, from);
    YamlNode *to = yaml_node(includes->tree, joined->values[section]);
    const uint32_t last = last_child(includes, from);
    uint32_t *link =
        joined->joined[section] > 0 ? &yaml_node(includes->tree, joined->joined[section])->next : &to->first;
    yaml_node(includes->tree, last)->next = *link;
    *link = yaml_node(includes->tree, from)->first;
    to->child_count += yaml_node(includes->tree, from)->child_count;
    joined->joined[section] = last;
}

// Adds a pair of an included file to the mapping.
static void pair_join(const Includes *includes, Joined *joined, size_t section, uint32_t key)
{
    YamlReader *reader = includes->reader;
    const uint32_t value = yaml_node(includes->tree, key)->next, existing = joined->values[section];
    const YamlType type = sections[section].type;
    const bool is_joined = type != YAML_SCALAR;
    if (is_joined && !node_has_type(reader, yaml_node(includes->tree, value), type, sections[section].name))
        return;
    if (existing == 0) {
        joined->values[section] = value;
        if (is_joined && yaml_node(includes->tree, value)->child_count > 0) {
            yaml_children_unshare(&reader->tree, value);
            joined->joined[section] = last_child(includes, value);
        }
        joined_append(includes, joined, key);
    } else if (is_joined && yaml_node(includes->tree, existing)->type == type) {
        children_join(includes, joined, section, value);
    }
}

// Adds the pairs of an included file's mapping to the mapping.
static void file_join(const Includes *includes, Joined *joined, uint32_t root)
{
    YamlReader *reader = includes->reader;
    bool seen[SECTION_COUNT] = {false};
    for (uint32_t key = yaml_node(includes->tree, root)->first, next; key > 0; key = next) {
        const size_t section = section_of(includes, key);
        next = yaml_node(includes->tree, yaml_node(includes->tree, key)->next)->next;
        if (section == SECTION_COUNT) { // unknown, which is reported with all others
            joined_append(includes, joined, key);
        } else if (seen[section]) {
            report_error(&reader->report, yaml_node(includes->tree, key)->offset, "'%s' is given twice",
                         sections[section].name);
        } else {
            seen[section] = true;
            pair_join(includes, joined, section, key);
        }
    }
}

// Adds the file's text to the sources and returns it.
static Source *source_add(Includes *includes, const char *path, Text *text)
{
    Source *source = memory_allocate(1, sizeof *source);
    text_append(text, "", 0); // allocates even an empty one
    *source = (Source){memory_copy_text(path), text->items, text->count, includes->last->next};
    includes->last->next = source;
    includes->last = source;
    array_push(includes->reader->included, source);
    const IncludedFile file = {memory_copy_text(path), hash_bytes(HASH_START, source->bytes, source->length)};
    array_push(includes->reader->scene->included, file);
    return source;
}

// Parses the file's text into the tree and sets the index of its root. Messages point into the text.
static bool text_parse(Includes *includes, Source *source, uint32_t *root)
{
    YamlReader *reader = includes->reader;
    MessageList messages = {0};
    const Source alone = {.file = source->file, .bytes = source->bytes, .length = source->length};
    Report report = report_open(&alone, &messages);
    *root = (uint32_t)reader->tree.nodes.count;
    stage_begin(reader->options->stage, "reading", source->file, source->length);
    const bool is_read = yaml_tree_read(&reader->tree, &report, includes->base, reader->options->stage);
    includes->base += source->length + 1;
    report_include(&reader->report, &report);
    return is_read && node_has_type(reader, yaml_node(includes->tree, *root), YAML_MAPPING, "scene");
}

static bool includes_read(Includes *includes, uint32_t root);

// Reads a file for the first time and adds it to the mapping.
static bool included_file_read(Includes *includes, Joined *joined, const char *path, const YamlNode *node)
{
    YamlReader *reader = includes->reader;
    Text text = {0};
    OwnedMessageList problems = {0};
    if (!text_read_file(&text, path, &problems))
        return report_error(&reader->report, node->offset, "%s", problems.items[0].text);
    KnownFile *known = &includes->files[includes->file_count - 1];
    uint32_t root;
    if (!text_parse(includes, source_add(includes, path, &text), &root)) return false;
    known->is_open = true;
    const bool all_read = includes_read(includes, root);
    known->is_open = false;
    if (all_read) file_join(includes, joined, root);
    return all_read && reader->report.error_count == 0;
}

// Adds the file that a value of `include` names, unless it was added before.
static bool file_include(Includes *includes, Joined *joined, const YamlNode *node)
{
    YamlReader *reader = includes->reader;
    const char *name = yaml_text(&reader->tree, node);
    if (!scene_is_yaml(name) || strcmp(name, "-") == 0)
        return expected_report(reader, "include", "a YAML file (.yaml, .yml or .json)", node);
    OWNED char *path = yaml_read_path(reader, "include", node);
    const char *obstacle = file_obstacle(path);
    if (obstacle) return report_error(&reader->report, node->offset, "cannot read '%s': %s", path, obstacle);
    const FileId file = file_id(path);
    size_t known = 0;
    while (known < includes->file_count && !file_is_same(includes->files[known].file, file))
        known++;
    if (known < includes->file_count)
        return !includes->files[known].is_open ||
               report_error(&reader->report, node->offset, "'%s' includes itself", path);
    includes->is_full = includes->file_count == COUNT_OF(includes->files);
    if (includes->is_full)
        return report_error(&reader->report, node->offset, "a scene may include at most %d files", FILES_MAX);
    includes->files[includes->file_count++] = (KnownFile){.file = file};
    return included_file_read(includes, joined, path, node);
}

// Removes the `include` of a mapping. Returns the index of its value, or 0 if there is none.
static uint32_t include_remove(const Includes *includes, uint32_t root)
{
    YamlReader *reader = includes->reader;
    uint32_t found = 0, *link = &yaml_node(includes->tree, root)->first;
    while (*link > 0) {
        const YamlNode *key = yaml_node(includes->tree, *link);
        YamlNode *value = yaml_node(includes->tree, key->next);
        if (!yaml_is(&reader->tree, key, "include")) {
            link = &value->next;
            continue;
        }
        if (found > 0)
            report_error(&reader->report, key->offset, "'include' is given twice");
        else
            found = key->next;
        *link = value->next;
        yaml_node(includes->tree, root)->child_count -= 2;
    }
    return found;
}

// Adds the files that a mapping includes.
static bool includes_read(Includes *includes, uint32_t root)
{
    const uint32_t include = include_remove(includes, root);
    if (include == 0) return true;
    const bool is_list = yaml_node(includes->tree, include)->type == YAML_SEQUENCE;
    Joined joined = joined_open(includes, root);
    bool all_read = true;
    for (uint32_t file = is_list ? yaml_node(includes->tree, include)->first : include; file > 0;) {
        all_read &= file_include(includes, &joined, yaml_node(includes->tree, file));
        if (includes->is_full || report_is_full(&includes->reader->report)) return false;
        file = is_list ? yaml_node(includes->tree, file)->next : 0;
    }
    return all_read;
}

bool yaml_include(YamlReader *reader, Source *source)
{
    Includes includes = {
        .reader = reader, .tree = &reader->tree, .last = source, .base = source->length + 1, .file_count = 1};
    if (reader->tree.nodes.items->type != YAML_MAPPING) return true; // is reported with its keys
    includes.files[0] = (KnownFile){file_id(source->file), true};
    return includes_read(&includes, 0) && reader->report.error_count == 0;
}

void yaml_included_free(YamlReader *reader)
{
    for (size_t i = 0; i < reader->included.count; i++) {
        free((char *)reader->included.items[i]->file);
        free((char *)reader->included.items[i]->bytes);
        free(reader->included.items[i]);
    }
    free(reader->included.items);
}
