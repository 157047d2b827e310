// Reads PLY files. Tests the layouts that are read, each with one square, and the errors for files that end
// before all declared data.
#include "host/scene/vector.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"

#define SCENE                                                                                                \
    "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\nlights: [{point: {position: [0, 0, -5]}}]\n"        \
    "objects:\n  - mesh: {file: a.ply}\n"

#define XYZ   "property float x\nproperty float y\nproperty float z\n"
#define FACES "element face 2\nproperty list uchar int vertex_indices\n"
#define ASCII "ply\nformat ascii 1.0\n"
#define END   "end_header\n"

// The square's corners and two triangles, a line each.
#define CORNERS   "0 0 0\n1 0 0\n0 1 0\n1 1 0\n"
#define TRIANGLES "3 0 1 2\n3 1 3 2\n"
#define HEADER    ASCII "element vertex 4\n" XYZ FACES END

static const double corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
static const uint32_t triangles[2][3] = {{0, 1, 2}, {1, 3, 2}};

static void assert_square(const Text *text)
{
    file_write_bytes("a.ply", text->items, text->count);
    OwnedScene scene = scene_of_text("scene.yaml", SCENE);
    assert_int_equal(scene.meshes.count, 1);
    const Mesh *mesh = &scene.meshes.items[0];
    assert_int_equal(mesh->triangle_count, 2);
    for (size_t i = 0; i < 6; i++) {
        const double *corner = corners[triangles[i / 3][i % 3]];
        Vector3 vertex = mesh->vertices[mesh->triangles[i / 3][i % 3]];
        assert_vector(vertex, corner[0], corner[1], corner[2]);
    }
}

// Expects one message about a.ply.
static void assert_refused(const char *message)
{
    assert_messages("scene.yaml", SCENE, formatted("%s\n", message));
}

TEST(ascii_layouts_are_read)
{
    static const char *const texts[] = {
        HEADER CORNERS TRIANGLES,
        // no newline at the end, after a longer line
        HEADER CORNERS "3 0 1 2 17\n3 1 3 2",
        HEADER "\n" CORNERS "\n\n\n" TRIANGLES "\n\nand more\n",
        HEADER "  0 0 0 \n\t1\t0  0\n+0 1. -.0e-5\n1E0 100e-2 0\n 3 0 1 2\t\n3 +1 3 2 0 0\n",
        "ply\ncomment 7 of all\nformat ascii 1.0\ncomment 5\ncomment vertex 3\nobj_info none\n"
        "element vertex 4\nproperty float x\nobj_info a\n property  float\ty\ncomment b\nproperty float z\n"
        "element  face 2\nproperty  list uchar  int vertex_index\nend_header \n" CORNERS TRIANGLES,
        ASCII "element vertex 4\nproperty uchar red\nproperty float32 z\nproperty float64 y\n"
              "property int8 kind\nproperty double x\nproperty float confidence\n" FACES END
              "255 0 0 -1 0 .5\n0 0 0 1 1 nan\n7 0 1 2 0 1e-9\n0 0 1 3 1 -inf\n" TRIANGLES,
        ASCII "element camera 2\nproperty float fov\nelement vertex 4\n" XYZ
              "element edge 1\nproperty int vertex1\nproperty int vertex2\nelement group 2\n"
              "property list uint float of\nelement empty 9000000000\n" FACES END "50\n60\n" CORNERS
              "0 1\n2 0.5 -1\n0\n" TRIANGLES,
        ASCII "element vertex 4\n" XYZ "property list uchar float x\nproperty list float int near\n"
              "element face 2\nproperty list uint8 float32 texcoord\nproperty ushort flags\n"
              "property list short uint vertex_indices\n" END
              "0 0 0 0 0\n1 0 0 1 7 2 1 2\n0 1 0 0 0\n1 1 0 0 0\n"
              "6 0 0 1 0 0 1 65535 3 0 1 2\n0 1 3 1 3 2\nand more\n",
    };
    for (size_t i = 0; i < COUNT_OF(texts); i++) {
        for (int ends = 0; ends < 3; ends++) {
            OwnedText text = text_with_line_ends(texts[i], ends);
            assert_square(&text);
        }
    }
}

typedef struct {
    const char *name;
    size_t size;
    bool real;
} Type;

static const Type types[] = {
    {"char", 1, false},  {"uchar", 1, false},  {"short", 2, false},  {"ushort", 2, false},
    {"int", 4, false},   {"uint", 4, false},   {"float", 4, true},   {"double", 8, true},
    {"int8", 1, false},  {"uint8", 1, false},  {"int16", 2, false},  {"uint16", 2, false},
    {"int32", 4, false}, {"uint32", 4, false}, {"float32", 4, true}, {"float64", 8, true},
};

static void number_append(Text *text, double number, const Type *type, bool big)
{
    uint64_t bits = type->real ? 0 : (uint64_t)(int64_t)number;
    float narrow = (float)number;
    uint32_t narrow_bits;
    memcpy(&narrow_bits, &narrow, sizeof narrow_bits);
    if (type->real && type->size == 4) bits = narrow_bits;
    if (type->real && type->size == 8) memcpy(&bits, &number, sizeof bits);
    for (size_t i = 0; i < type->size; i++) {
        char byte = (char)(bits >> 8 * (big ? type->size - 1 - i : i));
        text_append(text, &byte, 1);
    }
}

// Returns a square with numbers of this type in its coordinates and as lengths of lists, and with elements
// that no mesh has.
static Text binary_square(const Type *type, bool big, const char *line_end)
{
    const Type *single = &types[6], *whole = &types[4];
    Text text = {0};
    text_appendf(&text,
                 "ply%sformat binary_%s_endian 1.0%selement group 1%sproperty list %s double of%s"
                 "element vertex 4%sproperty %s kind%sproperty float x%sproperty float y%sproperty float z%s"
                 "element face 2%sproperty list %s %s other%sproperty list %s int vertex_index%send_header%s",
                 line_end, big ? "big" : "little", line_end, line_end, type->name, line_end, line_end,
                 type->name, line_end, line_end, line_end, line_end, line_end, type->name, type->name,
                 line_end, type->name, line_end, line_end);
    number_append(&text, 1, type, big);
    number_append(&text, 0.5, &types[7], big);
    for (size_t i = 0; i < 4; i++) {
        number_append(&text, 10, type, big); // for most types the body starts with a newline then
        for (size_t axis = 0; axis < 3; axis++)
            number_append(&text, corners[i][axis], single, big);
    }
    for (size_t i = 0; i < 2; i++) {
        number_append(&text, 1, type, big);
        number_append(&text, 9, type, big);
        number_append(&text, 3, type, big);
        for (size_t k = 0; k < 3; k++)
            number_append(&text, triangles[i][k], whole, big);
    }
    return text;
}

TEST(binary_layouts_are_read)
{
    for (size_t i = 0; i < COUNT_OF(types); i++) {
        for (int big = 0; big < 2; big++) {
            for (int returns = 0; returns < 2; returns++) {
                OwnedText text = binary_square(&types[i], big, returns ? "\r\n" : "\n");
                assert_square(&text);
            }
        }
    }
}

TEST(faults_name_line_and_row)
{
    static const struct {
        const char *text, *message;
    } cases[] = {
        {HEADER CORNERS "3 0 1 2\n2000000000 1 3 2\n",
         "15:1: error: face 1 (counted from 0) declares 2000000000 numbers of 'vertex_indices', but the line "
         "has only 3"},
        {HEADER CORNERS "3 0 1\n3 1 3 2\n", "14:1: error: face 0 (counted from 0) declares 3 numbers of "
                                            "'vertex_indices', but the line has only 2"},
        {HEADER CORNERS "3 0 1 2\n", "15:1: error: the file ends before face 1 (counted from 0) of 2"},
        {HEADER CORNERS, "14:1: error: the file ends before face 0 (counted from 0) of 2"},
        {HEADER "0 0 0\n1 0\n0 1 0\n1 1 0\n" TRIANGLES,
         "11:4: error: vertex 1 (counted from 0) lacks its 'z'"},
        {HEADER "0 0 0\n1 x 0\n0 1 0\n1 1 0\n" TRIANGLES, "11:3: error: 'x' is not a number of type float"},
        {HEADER "0 0 0\n1 0 1.5.5\n0 1 0\n1 1 0\n" TRIANGLES,
         "11:5: error: '1.5.5' is not a number of type float"},
        {HEADER CORNERS "3 0 1 2\n-1 1 3 2\n", "15:1: error: '-1' is not a number of type uchar"},
        {HEADER CORNERS "3 0 1 2\n3 1 3 1.5\n", "15:7: error: '1.5' is not a number of type int"},
        {HEADER CORNERS "3 0 1 2\n3 1 3 4294967298\n",
         "15:7: error: '4294967298' is not a number of type int"},
        {ASCII "element vertex 4\n" XYZ "element face 2\nproperty list int int vertex_indices\n" END CORNERS
               "3 0 1 2\n-3 1 3 2\n",
         "15:1: error: the length of a list must be whole, not -3"},
        {ASCII "element vertex 4\n" XYZ "element face 2\nproperty list float int vertex_indices\n" END CORNERS
               "3 0 1 2\n2.5 1 3 2\n",
         "15:1: error: the length of a list must be whole, not 2.5"},
        {ASCII "element vertex 4\n" XYZ "element face 1\nproperty list uchar float texcoord\n"
               "property list uchar int vertex_index\n" END CORNERS "6 0 0 1 0 0 1 1 0\n",
         "15:18: error: face 0 (counted from 0) has 1 corner, but 3 texture coordinates"},
        {ASCII "element vertex 4\nproperty int64 x\n" END, "4:10: error: unknown PLY type 'int64'"},
        {ASCII "element vertex 4\nproperty list uchar half x\n" END, "4:21: error: unknown PLY type 'half'"},
        {ASCII "element vertex 4\nproperty float\n" END, "4:15: error: the property has no name"},
        {ASCII XYZ END, "3:9: error: a property must follow an element"},
        {ASCII "element vertex -4\n" END, "3:16: error: the number of 'vertex' must be whole, not '-4'"},
        {ASCII "element vertex 4\n" XYZ "element vertex 4\n" XYZ END,
         "7:9: error: the header declares 'vertex' twice"},
        {ASCII "element vertex 4\n" XYZ
               "element tristrips 1\nproperty list int int vertex_indices\n" END CORNERS "4 0 1 2 3\n",
         "7:9: error: strips of triangles (tristrips) are not supported; export the mesh with faces"},
        {"ply\nformat binary 1.0\n" END, "2:8: error: unknown PLY format 'binary'"},
        {"ply\nelement vertex 0\n" END, "3:1: error: the header lacks a line 'format'"},
        {"solid\n", "1:1: error: a PLY file must start with a line 'ply'"},
        {"", "1:1: error: a PLY file must start with a line 'ply'"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        file_write("a.ply", cases[i].text);
        assert_refused(cases[i].message);
    }
}

#define BINARY(count_type)                                                                                   \
    "ply\nformat binary_big_endian 1.0\nelement vertex 4\n" XYZ "element face 2\nproperty list " count_type  \
    " int vertex_indices\n" END

// Returns a square's bytes with this as the second triangle's number of corners.
static Text binary_with_count(const char *header, double count, const Type *type)
{
    Text text = {0};
    text_appendf(&text, "%s", header);
    for (size_t i = 0; i < 12; i++)
        number_append(&text, corners[i / 3][i % 3], &types[6], true);
    for (size_t i = 0; i < 2; i++) {
        number_append(&text, i == 0 ? 3 : count, type, true);
        for (size_t k = 0; k < 3; k++)
            number_append(&text, triangles[i][k], &types[4], true);
    }
    return text;
}

TEST(binary_faults_name_byte_and_row)
{
    static const char *const headers[] = {BINARY("uchar"), BINARY("int"), BINARY("double")};
    static const struct {
        size_t header;
        double count;
        size_t type;
        const char *promise;
    } cases[] = {{1, 2000000000, 4, "2000000000"},
                 {1, -1, 4, "-1"},
                 {1, 4, 4, "4"},
                 {0, 4, 1, "4"},
                 {2, NAN, 7, "nan"},
                 {2, 2.5, 7, "2.5"},
                 {2, 1e300, 7, "1e+300"}};
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        const Type *type = &types[cases[i].type];
        OwnedText text = binary_with_count(headers[cases[i].header], cases[i].count, type);
        file_write_bytes("a.ply", text.items, text.count);
        assert_refused(
            formatted("4:18: error: a.ply: byte %zu: face 1 (counted from 0) declares %s numbers of "
                      "'vertex_indices', but the file has only 3",
                      text.count - type->size - 12, cases[i].promise));
    }
}

// A file truncated anywhere is rejected with the position.
TEST(binary_file_cut_short_is_refused)
{
    OwnedText whole = binary_with_count(BINARY("uchar"), 3, &types[1]);
    assert_square(&whole);
    const size_t header_size = strlen(BINARY("uchar"));
    char *no_body = text_format("byte %zu: vertex 0 (counted from 0) lacks its 'x'", header_size);
    for (size_t size = header_size; size < whole.count; size++) {
        file_write_bytes("a.ply", whole.items, size);
        OwnedText messages = scene_messages("scene.yaml", SCENE, false);
        assert_non_null(strstr(text_c(&messages), "4:18: error: a.ply: byte "));
        if (size == header_size) assert_non_null(strstr(text_c(&messages), no_body));
    }
    free(no_body);
}

static Scene scene_of_ply(const char *ply, const char *expected)
{
    file_write("a.ply", ply);
    assert_messages("scene.yaml", SCENE, expected);
    return scene_of_text("scene.yaml", SCENE);
}

// Normals and texture coordinates of vertices, and those of corners, which a vertex may have several of.
TEST(normals_and_uvs_are_read)
{
    Scene scene = scene_of_ply(
        ASCII FACES "element vertex 4\n" XYZ "property float nx\nproperty float ny\nproperty float nz\n"
                    "property float s\nproperty double t\n" END TRIANGLES
                    "0 0 0 0 0 2 0.5 0.25\n1 0 0 0 1 0 1 0\n0 1 0 0 1 0 nan 1\n1 1 0 0 inf 0 1 1\n",
        "4:18: warning: a.ply: 1 texture coordinate is not finite or too large and is read as 0\n"
        "4:18: warning: a.ply: 1 normal is not finite or too large and is ignored\n");
    const Mesh *mesh = &scene.meshes.items[0];
    const uint32_t(*read)[3] = (const uint32_t(*)[3])mesh->triangles;
    assert_int_equal(mesh->vertex_count, 4);
    assert_vector(mesh->normals[read[0][0]], 0, 0, 1);
    assert_vector(mesh->normals[read[0][1]], 0, 1, 0);
    assert_vector(mesh->normals[read[1][1]], 0, 0, 0);
    assert_number(mesh->uvs[read[0][0]][0], 0.5);
    assert_number(mesh->uvs[read[0][0]][1], 0.25);
    assert_number(mesh->uvs[read[0][2]][0], 0);
    scene_free(&scene);

    scene = scene_of_ply(
        ASCII "element face 2\nproperty list uchar float texcoord\nproperty list uchar int vertex_index\n"
              "element vertex 4\n" XYZ "property float u\nproperty float v\n" END
              "6 0 0 1 0 0 1 3 0 1 2\n4 1 0.5 1 1 3 1 3 2\n"
              "0 0 0 9 9\n1 0 0 9 9\n0 1 0 9 9\n1 1 0 9 9\n",
        "");
    mesh = &scene.meshes.items[0];
    read = (const uint32_t(*)[3])mesh->triangles;
    assert_null(mesh->normals);
    assert_int_equal(mesh->vertex_count, 6);
    assert_number(mesh->uvs[read[0][1]][0], 1);
    assert_number(mesh->uvs[read[0][1]][1], 0);
    assert_number(mesh->uvs[read[1][0]][1], 0.5);
    assert_number(mesh->uvs[read[1][2]][0], 0);
    scene_free(&scene);
}

TEST(what_is_not_used_is_reported)
{
    Scene scene = scene_of_ply(ASCII "element vertex 4\n" XYZ "property uchar red\nproperty uchar green\n"
                                     "element edge 1\nproperty int vertex1\nelement empty 9\n" FACES END
                                     "0 0 0 1 1\n1 0 0 1 1\n0 1 0 1 1\n1 1 0 1 1\n0\n" TRIANGLES,
                               "7:16: warning: these properties of 'vertex' are ignored: 'red', 'green'\n"
                               "9:9: warning: the element 'edge' is ignored\n");
    scene_free(&scene);
    scene = scene_of_ply(HEADER CORNERS "3 0 1 2 4\n3 1 3 2 5\n\n\n more\nlines\n",
                         "14:9: warning: words after the last property of a row are ignored\n"
                         "18:2: warning: lines after the last element are ignored\n");
    scene_free(&scene);
    OwnedText bytes = binary_with_count(BINARY("uchar"), 3, &types[1]);
    text_append(&bytes, "\n", 1);
    file_write_bytes("a.ply", bytes.items, bytes.count);
    assert_messages("scene.yaml", SCENE, "4:18: warning: a.ply: 1 byte after the last element is ignored\n");
}

TEST(vertices_without_a_coordinate_are_refused)
{
    file_write("a.ply",
               ASCII "element vertex 1\nproperty float x\nproperty float z\n" FACES END "0 0\n" TRIANGLES);
    assert_refused("3:9: error: the vertices have no 'y'");
}

TEST_MAIN(folder_open, folder_close)
