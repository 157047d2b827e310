// Reads STL files in text and binary. Tests their facets, and messages about wrong ones.
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"

#define SCENE                                                                                                \
    "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\nlights: [{point: {position: [0, 0, -5]}}]\n"        \
    "objects:\n  - mesh: {file: a.stl, smooth: true}\n"

#define FACET(a, b, c)                                                                                       \
    "facet normal 0 0 9\n  outer loop\n    vertex " a "\n    vertex " b "\n    vertex " c "\n  endloop\n"    \
    "endfacet\n"
#define TWO_FACETS FACET("0 0 0", "1 0 0", "0 1 0") FACET("0 1 0", "1.0e0 0 0", "+1 1 -0")

// Asserts that the scene has two triangles of four vertices, not the facets' normals, and these messages.
static void assert_square(const char *messages)
{
    static const double expected[6][2] = {{0, 0}, {1, 0}, {0, 1}, {0, 1}, {1, 0}, {1, 1}};
    assert_messages("scene.yaml", SCENE, messages);
    OwnedScene scene = scene_of_text("scene.yaml", SCENE);
    const Mesh *mesh = &scene.meshes.items[0];
    assert_int_equal(mesh->triangle_count, 2);
    assert_int_equal(mesh->vertex_count, 4);
    for (size_t i = 0; i < 6; i++) {
        const Vector3 corner = mesh->vertices[mesh->triangles[i / 3][i % 3]];
        assert_vector(corner, expected[i][0], expected[i][1], 0);
        assert_vector(mesh->normals[mesh->triangles[i / 3][i % 3]], 0, 0, 1);
    }
}

TEST(text_is_read)
{
    static const struct {
        const char *text, *messages;
    } cases[] = {
        {"solid part # 1\n" TWO_FACETS "endsolid part\n", ""},
        {"SOLID\r\nFACET NORMAL 0 0 1\r\nOUTER LOOP\r\nVERTEX 0 0 0\r\nVertex 1 0 0\r\nVERTEX 0 1 "
         "0\r\nENDLOOP\r\n"
         "ENDFACET\r\n" FACET("0 1 0", "1 0 0", "1 1 0"),
         ""},
        {"solid a\n" FACET("0 0 0", "1 0 0", "0 1 0") "endsolid a\nsolid b\ncolor 1 0 0\ncolor 1 0 0\n" FACET(
             "0 1 0", "1 0 0", "1 1 0") "endsolid b",
         "11:1: warning: 'color' is not a keyword of STL and is ignored\n"},
        {" \tsolid\n" TWO_FACETS, ""},
        {"\xEF\xBB\xBFsolid\n" TWO_FACETS, ""},
        {"# made by hand\r\r\n\nsolid\n" TWO_FACETS, ""},
        {"; by hand\n solid\n" TWO_FACETS, "1:1: warning: ';' is not a keyword of STL and is ignored\n"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        file_write("a.stl", cases[i].text);
        assert_square(cases[i].messages);
    }
}

enum { HEADER = 84, FACET_SIZE = 50, WHOLE = HEADER + 2 * FACET_SIZE };

static void binary_fill(char bytes[WHOLE], const char *title)
{
    static const float corners[2][3][3] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                                           {{0, 1, 0}, {1, 0, 0}, {1, 1, 0}}};
    memset(bytes, 0, WHOLE);
    for (size_t i = 0; title[i] != '\0'; i++)
        bytes[i] = title[i];
    bytes[80] = 2;
    for (size_t i = 0; i < 2; i++)
        memcpy(bytes + HEADER + i * FACET_SIZE + 12, corners[i], sizeof corners[i]);
}

TEST(binary_is_read)
{
    static const char *const titles[] = {"", "a title", "solid part"};
    char bytes[WHOLE + 3] = {0};
    for (size_t i = 0; i < 3; i++) {
        binary_fill(bytes, titles[i]);
        file_write_bytes("a.stl", bytes, WHOLE);
        assert_square("");
    }
    binary_fill(bytes, "colored");
    bytes[WHOLE - 1] = 1;
    file_write_bytes("a.stl", bytes, WHOLE + 3);
    assert_square("4:18: warning: a.stl: attributes of facets, such as colors, are ignored\n"
                  "4:18: warning: a.stl: 3 bytes after the last facet are ignored\n");
}

TEST(faults_have_their_place)
{
    static const struct {
        const char *text, *message;
    } cases[] = {
        {"solid\n" FACET("0 0 0", "1 x 0", "0 1 0"),
         "5:14: error: a coordinate must be a number of at most 1e+30 in magnitude, not 'x'\n"},
        {"solid\n" FACET("0 0 0", "1 0", "0 1 0"), "5:15: error: a coordinate of the vertex is missing\n"},
        {"solid\n" FACET("0 0 0", "1 1e31 0", "0 1 0"),
         "5:14: error: a coordinate must be a number of at most 1e+30 in magnitude, not '1e31'\n"},
        {"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
         "6:1: error: a facet has 2 corners instead of 3\n"},
        {"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n",
         "7:1: error: the file ends within a facet\n"},
        {"solid\nendsolid\n", "4:18: error: a.stl: the mesh has no triangles\n"},
        {"facet", "4:18: error: a.stl: byte 5: an STL file must start with 'solid' or have 84 bytes before "
                  "its facets\n"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        file_write("a.stl", cases[i].text);
        assert_messages("scene.yaml", SCENE, cases[i].message);
    }
    char bytes[WHOLE];
    binary_fill(bytes, "");
    file_write_bytes("a.stl", bytes, WHOLE - 1);
    assert_messages("scene.yaml", SCENE,
                    "4:18: error: a.stl: byte 80: 2 facets are declared, but the file has only 1\n");
    memset(bytes + 80, 0xff, 4);
    file_write_bytes("a.stl", bytes, WHOLE);
    assert_messages("scene.yaml", SCENE,
                    "4:18: error: a.stl: byte 80: 4294967295 facets are declared; at most 1431655764 are "
                    "supported (a text file must start with 'solid')\n");
    binary_fill(bytes, "");
    memset(bytes + HEADER + 12, 0xff, 4);
    file_write_bytes("a.stl", bytes, WHOLE);
    assert_messages("scene.yaml", SCENE,
                    "4:18: error: a.stl: vertex 0 (counted from 0) has a coordinate that is not a number of "
                    "at most 1e+30 in magnitude\n");
}

TEST_MAIN(folder_open, folder_close)
