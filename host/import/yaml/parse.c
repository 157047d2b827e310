#include "host/import/yaml/parse.h"
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"

#include <errno.h>
#include <libfyaml.h>
#include <stdlib.h>
#include <string.h>

enum { DEPTH_MAX = 32, ANCHORS_MAX = 1000 };

static const char not_well_formed[] = "the text is not well-formed YAML";

typedef struct {
    size_t text, length; // name in the source
    uint32_t node;
} Anchor;

typedef struct {
    uint32_t node, last_child;
} OpenNode;

typedef struct {
    YamlTree *tree;
    Report *report;
    const Source *parsed;
    YamlCut *cut; // NULL if the parsed text is the whole source
    size_t root;  // index of the source's first node
    size_t base;  // of the offsets of the source's nodes
    size_t gap;   // between the offsets of the parsed text and of the source, once the cut is passed
    OpenNode open[DEPTH_MAX];
    size_t depth;
    size_t end;       // of the last event: the position of an empty value
    size_t value_end; // of the last value: a block of them ends there, before comments
    ARRAY_OF(Anchor) anchors;
} TreeBuilder;

static void node_append(TreeBuilder *builder, YamlNode node)
{
    YamlTree *tree = builder->tree;
    uint32_t index = (uint32_t)tree->nodes.count;
    node.offset += (uint32_t)(builder->base + builder->gap);
    node.end += (uint32_t)(builder->base + builder->gap);
    array_push(tree->nodes, node);
    if (!builder->depth) return;
    OpenNode *parent = &builder->open[builder->depth - 1];
    tree->nodes.items[parent->node].child_count++;
    if (parent->last_child)
        tree->nodes.items[parent->last_child].next = index;
    else
        tree->nodes.items[parent->node].first = index;
    parent->last_child = index;
}

// Appends a token's text. A plain text of one line consists of its bytes in the source. Other texts are
// appended by chunks, because libfyaml 0.7's fy_token_get_text leaks on some quoted texts of several lines,
// and its fy_token_iter_read returns chunks in the wrong order.
static bool token_append_text(Text *text, struct fy_token *token, const Source *parsed)
{
    const struct fy_mark *start = fy_token_start_mark(token), *end = fy_token_end_mark(token);
    if (fy_token_scalar_style(token) == FYSS_PLAIN && start->line == end->line) {
        text_append(text, parsed->bytes + start->input_pos, end->input_pos - start->input_pos);
        return true;
    }
    struct fy_token_iter *iterator = fy_token_iter_create(token);
    if (!iterator) fault("libfyaml: out of memory");
    const struct fy_iter_chunk *chunk = NULL;
    int error = 0;
    while ((chunk = fy_token_iter_chunk_next(iterator, chunk, &error)))
        text_append(text, chunk->str, chunk->len);
    fy_token_iter_destroy(iterator);
    return !error;
}

static bool scalar_append(TreeBuilder *builder, struct fy_token *token, YamlNode node)
{
    Text *texts = &builder->tree->texts;
    node.type = YAML_SCALAR;
    node.text = (uint32_t)texts->count;
    if (token && !token_append_text(texts, token, builder->parsed))
        return report_error(builder->report, node.offset, not_well_formed);
    text_append(texts, "", 1);
    if (memchr(texts->items + node.text, '\0', texts->count - node.text - 1))
        return report_error(builder->report, node.offset, "strings must not contain NUL characters");
    node_append(builder, node);
    return true;
}

static bool collection_open(TreeBuilder *builder, YamlNode node)
{
    if (builder->depth == DEPTH_MAX)
        return report_error(builder->report, node.offset, "values may be nested at most %d levels deep",
                            DEPTH_MAX);
    uint32_t index = (uint32_t)builder->tree->nodes.count;
    node_append(builder, node);
    builder->open[builder->depth++] = (OpenNode){.node = index};
    return true;
}

static void collection_close(TreeBuilder *builder)
{
    YamlNode *node = &builder->tree->nodes.items[builder->open[--builder->depth].node];
    const char first = builder->report->source->bytes[node->offset - builder->base];
    if (first == '[' || first == '{') builder->value_end = builder->end;
    node->end = (uint32_t)(builder->base + builder->gap + builder->value_end);
}

// Returns the anchor of a name. Later anchors hide earlier ones of the same name (YAML 1.2.2, section 7.1).
static const Anchor *anchor_find(const TreeBuilder *builder, const char *name, size_t length)
{
    for (size_t i = builder->anchors.count; i-- > 0;) {
        const Anchor *anchor = &builder->anchors.items[i];
        if (anchor->length == length && !memcmp(builder->parsed->bytes + anchor->text, name, length))
            return anchor;
    }
    return NULL;
}

static bool alias_append(TreeBuilder *builder, const char *name, size_t length, size_t offset)
{
    const Anchor *anchor = anchor_find(builder, name, length);
    if (!anchor)
        return report_error(builder->report, offset, "no anchor precedes the alias '*%.*s'",
                            (int)(length < WORD_SHOWN ? length : WORD_SHOWN), name);
    for (size_t i = 0; i < builder->depth; i++)
        if (builder->open[i].node == anchor->node)
            return report_error(builder->report, offset, "the alias is recursive");
    YamlNode copy = builder->tree->nodes.items[anchor->node];
    copy.next = 0;
    copy.offset -= (uint32_t)(builder->base + builder->gap); // which node_append adds
    copy.end -= (uint32_t)(builder->base + builder->gap);
    node_append(builder, copy);
    builder->tree->has_aliases = true;
    return true;
}

static bool anchor_add(TreeBuilder *builder, struct fy_token *token)
{
    size_t start = fy_token_start_mark(token)->input_pos,
           length = fy_token_end_mark(token)->input_pos - start;
    if (builder->anchors.count == ANCHORS_MAX)
        return report_error(builder->report, start, "a file may have at most %d anchors", ANCHORS_MAX);
    Anchor anchor = {.text = start, .length = length, .node = (uint32_t)builder->tree->nodes.count};
    array_push(builder->anchors, anchor);
    return true;
}

// Passes the cut at a node that begins at or after it. Returns false if the node is not the item there.
static bool cut_pass(TreeBuilder *builder, size_t offset)
{
    YamlCut *cut = builder->cut;
    if (offset != cut->offset || builder->depth != YAML_CUT_DEPTH) return false;
    const OpenNode *list = &builder->open[YAML_CUT_DEPTH - 1];
    if (builder->tree->nodes.items[list->node].type != YAML_SEQUENCE || !list->last_child) return false;
    cut->is_passed = true;
    cut->list = list->node;
    cut->last_before = list->last_child;
    builder->gap = cut->gap;
    return true;
}

static bool event_read(TreeBuilder *builder, struct fy_event *event)
{
    const struct fy_mark *start = fy_event_start_mark(event), *end = fy_event_end_mark(event);
    YamlNode node = {.offset = (uint32_t)(start ? start->input_pos : builder->end)};
    if (end) builder->end = end->input_pos;
    node.end = (uint32_t)builder->end;
    bool is_node =
        event->type == FYET_SCALAR || event->type == FYET_SEQUENCE_START || event->type == FYET_MAPPING_START;
    if (builder->cut && is_node && node.offset >= builder->cut->offset && !builder->cut->is_passed) {
        if (!cut_pass(builder, node.offset)) return false;
        if (builder->cut->gap == 0) return true;
    }
    if (is_node && fy_event_get_tag_token(event))
        return report_error(builder->report, fy_token_start_mark(fy_event_get_tag_token(event))->input_pos,
                            "a scene must not have tags");
    if (is_node && fy_event_get_anchor_token(event) && !anchor_add(builder, fy_event_get_anchor_token(event)))
        return false;

    switch (event->type) {
    case FYET_DOCUMENT_START:
        if (builder->tree->nodes.count > builder->root)
            return report_error(builder->report, node.offset,
                                "there is a second document; only one is allowed");
        return true;
    case FYET_SCALAR:
        builder->value_end = builder->end;
        return scalar_append(builder, event->scalar.value, node);
    case FYET_ALIAS: {
        builder->value_end = builder->end;
        size_t length;
        const char *name = fy_token_get_text(event->alias.anchor, &length);
        return alias_append(builder, name, length, node.offset - strlen("*"));
    }
    case FYET_SEQUENCE_START:
        node.type = YAML_SEQUENCE;
        return collection_open(builder, node);
    case FYET_MAPPING_START:
        node.type = YAML_MAPPING;
        return collection_open(builder, node);
    case FYET_SEQUENCE_END:
    case FYET_MAPPING_END:
        collection_close(builder);
        return true;
    default:
        return true;
    }
}

// Returns the byte offset of libfyaml's line and column, both from 1; columns count characters.
static size_t place_offset(const Source *source, int line, int column)
{
    size_t at = 0;
    for (int i = 1; i < line && at < source->length; at++)
        i += source->bytes[at] == '\n';
    for (int i = 1; i < column && at < source->length && source->bytes[at] != '\n'; i++) {
        at++;
        while (at < source->length && (source->bytes[at] & 0xC0) == 0x80)
            at++;
    }
    return at;
}

// Reports the parser's first error. `parsed` is the parsed text and `end` the parser's position, for the few
// errors that it does not describe.
static void syntax_report(struct fy_diag *diagnostics, Report *report, const Source *parsed, size_t end)
{
    if (errno == ENOMEM) fault("out of memory: reading %s%s", report->source->file, fault_limits());
    void *iterator = NULL;
    const struct fy_diag_error *error = fy_diag_errors_iterate(diagnostics, &iterator);
    if (!error) {
        report_error(report, end, not_well_formed);
        return;
    }
    report_error(report, place_offset(parsed, error->line, error->column), "%s", error->msg);
}

static void diagnostic_ignore(struct fy_diag *diag, void *user, const char *text, size_t length)
{
    (void)diag, (void)user, (void)text, (void)length;
}

static bool tree_build(TreeBuilder *builder, struct fy_parser *parser, struct fy_diag *diagnostics,
                       Stage *stage)
{
    const YamlCut *cut = builder->cut;
    size_t shown = 0;
    for (bool ended = false; !ended;) {
        struct fy_event *event = fy_parser_parse(parser);
        if (!event) {
            syntax_report(diagnostics, builder->report, builder->parsed, builder->end);
            return false;
        }
        ended = event->type == FYET_STREAM_END;
        const bool is_read = event_read(builder, event);
        fy_parser_event_free(parser, event);
        if (builder->depth <= YAML_CUT_DEPTH) {
            stage_add(stage, builder->end - shown);
            shown = builder->end;
        }
        if (!is_read) return false;
        if (cut && cut->is_passed && cut->gap == 0) return builder->anchors.count == 0;
    }
    if (cut) return cut->is_passed;
    if (builder->tree->nodes.count == builder->root)
        return report_error(builder->report, 0, "the scene is empty");
    return true;
}

bool yaml_parse(YamlTree *tree, Report *report, size_t base, const Source *parsed, YamlCut *cut, Stage *stage)
{
    struct fy_diag_cfg quiet;
    fy_diag_cfg_default(&quiet);
    quiet.fp = NULL;
    quiet.output_fn = diagnostic_ignore;
    struct fy_diag *diagnostics = fy_diag_create(&quiet);
    fy_diag_set_collect_errors(diagnostics, true);
    struct fy_parse_cfg settings = {.flags = FYPCF_DEFAULT_PARSE | FYPCF_JSON_NONE, .diag = diagnostics};
    struct fy_parser *parser = fy_parser_create(&settings);
    if (!parser || fy_parser_set_string(parser, parsed->bytes, parsed->length))
        fault("libfyaml: cannot make a parser");

    TreeBuilder builder = {.tree = tree,
                           .report = report,
                           .parsed = parsed,
                           .cut = cut,
                           .root = tree->nodes.count,
                           .base = base};
    errno = 0;
    bool built = tree_build(&builder, parser, diagnostics, stage);
    free(builder.anchors.items);
    fy_parser_destroy(parser);
    fy_diag_destroy(diagnostics);
    return built;
}
