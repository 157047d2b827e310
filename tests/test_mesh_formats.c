// Tests what is read of each format of meshes, with normals and texture coordinates, what faults are named,
// and what the process that runs assimp may do.
#include "host/base/base64.h"
#include "host/compile/scene_bounds.h"
#include "host/import/mesh/assimp_process.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/scene_reading.h"
#include <signal.h>

#define CAMERA_AND_LIGHT                                                                                     \
    "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\n"                                                   \
    "lights: [{point: {position: [0, 0, -5]}}]\n"

static char *corpus; // one file for each format that assimp reads

static int formats_open(void **state)
{
    corpus = realpath("tests/fuzz/corpus/assimp", NULL);
    return corpus ? folder_open(state) : -1;
}

static int formats_close(void **state)
{
    free(corpus);
    return folder_close(state);
}

// Returns a scene whose only objects are `objects`, one per line.
static Scene scene_of_objects(const char *objects)
{
    return scene_of_text("scene.yaml", formatted(CAMERA_AND_LIGHT "objects:\n%s", objects));
}

#define PLY_HEADER(vertex_count, face_count)                                                                 \
    "ply\nformat ascii 1.0\nelement vertex " vertex_count                                                    \
    "\nproperty float x\nproperty float y\nproperty float z\nelement face " face_count                       \
    "\nproperty list uchar int vertex_indices\n"
#define PLY_OF(y, index) PLY_HEADER("3", "1") "end_header\n0 0 0\n1 0 0\n0 " y " 0\n3 0 1 " index "\n"
// Four vertices, the unit square's first three in this order, and two faces.
#define PLY_OF_FACES(first, second)                                                                          \
    PLY_HEADER("4", "2") "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n" first "\n" second "\n"
#define STL_OF(y)                                                                                            \
    "solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 " y                    \
    " 0\nendloop\nendfacet\nendsolid part\n"

// One triangle, moved by its node.
#define GLTF_MEMBERS                                                                                         \
    "\"asset\": {\"version\": \"2.0\"}, \"scene\": 0, \"scenes\": [{\"nodes\": [0]}],\n"                     \
    "\"nodes\": [{\"children\": [1], \"translation\": [1, 2, 3]}, {\"mesh\": 0, \"scale\": [2, 2, 2]}],\n"   \
    "\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}],\n"                               \
    "\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\",\n"       \
    "\"min\": [0, 0, 0], \"max\": [1, 1, 0]}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": 36}],\n"    \
    "\"buffers\": [{\"byteLength\": 36, \"uri\": \"data:application/octet-stream;base64,"                    \
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}\n"
static const char gltf[] = "{" GLTF_MEMBERS;

TEST(every_format_is_read)
{
    file_write("a.ply", PLY_OF("1", "2"));
    file_write("a.stl", STL_OF("1"));
    file_write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    file_write("a.gltf", gltf);
    OwnedScene scene =
        scene_of_objects("  - mesh: {file: a.ply}\n  - mesh: {file: a.stl}\n  - mesh: {file: a.off}\n"
                         "  - mesh: {file: a.gltf}\n");
    assert_int_equal(scene.meshes.count, 4);
    for (size_t i = 0; i < 4; i++) {
        const Mesh *mesh = &scene.meshes.items[i];
        assert_int_equal(mesh->triangle_count, 1);
        Vector3 b = mesh->vertices[mesh->triangles[0][1]], c = mesh->vertices[mesh->triangles[0][2]];
        if (i < 3) {
            assert_vector(b, 1, 0, 0);
            assert_vector(c, 0, 1, 0);
        } else {
            assert_vector(b, 3, 2, 3);
            assert_vector(c, 1, 4, 3);
        }
    }
}

TEST(faces_without_corners_are_left_out)
{
    file_write("a.ply", PLY_OF_FACES("0", "4 0 1 3 2"));
    OwnedScene scene = scene_of_objects("  - mesh: {file: a.ply}\n");
    assert_int_equal(scene.meshes.items[0].triangle_count, 2);
}

// Vertices and texture coordinates that no triangle has are neither refused nor in the mesh.
TEST(what_no_face_uses_does_not_count)
{
    static const struct {
        const char *name, *text;
    } cases[] = {
        {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 1e38\nv 9 9 9\nvt nan nan\nvt 0 0\n"
                  "f 1/2 2/2 3/2\nl 2/1 4/1 5/2\n"},
        {"a.ply", PLY_HEADER("5\nproperty float s\nproperty float t",
                             "2") "end_header\n0 0 nan 0 0\n0 0 0 0 0\n0 0 1 0 0\n0 0 0 1 0\ninf 0 9 9 9\n"
                                  "3 1 2 3\n2 0 4\n"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        file_write(cases[i].name, cases[i].text);
        OwnedScene scene = scene_of_objects(formatted("  - mesh: {file: %s}\n", cases[i].name));
        assert_int_equal(scene.meshes.items[0].triangle_count, 1);
        assert_int_equal(scene.meshes.items[0].vertex_count, 3);
        const Bounds bounds = scene_extent(&scene).bounds;
        assert_vector(bounds.min, 0, 0, 0);
        assert_vector(bounds.max, 1, 1, 0);
    }
}

TEST(faults_name_file_and_vertex)
{
    static const struct {
        const char *name, *text, *message;
    } cases[] = {
        {"a.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n",
         "4:18: warning: a.obj: faces of one or two corners are not shown\n4:18: error: a.obj: the mesh has "
         "no triangles"},
        {"a.ply", PLY_OF("nan", "2"),
         "12:3: error: a coordinate must be a number of at most 1e+30 in magnitude, not 'nan'"},
        {"a.ply", PLY_OF("1", "7"),
         "13:8: error: a face names vertex 7 (counted from 0), but the file has only 3"},
        {"a.ply", PLY_OF_FACES("3 0 1 2", "4 0 1 3 -1"),
         "15:11: error: face 1 (counted from 0) names vertex -1, which cannot exist"},
        {"a.ply", PLY_OF_FACES("3 0 1 2", "4 0 1 3 400000000"),
         "15:18: error: a face names vertex 400000000 (counted from 0), but the file has only 4"},
        {"a.ply", PLY_OF_FACES("5 0 1 3 2 400000000", "3 0 1 2"),
         "14:20: error: a face names vertex 400000000 (counted from 0), but the file has only 4"},
        {"a.ply", PLY_OF_FACES("0", "2 0 1"),
         "4:18: warning: a.ply: faces of one or two corners are not shown\n4:18: error: a.ply: the mesh has "
         "no triangles"},
        {"a.ply", PLY_HEADER("3", "1"), "9:1: error: the header lacks a line 'end_header'"},
        {"a.ply", PLY_HEADER("3", "1") "end_header too\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
         "14:1: error: the header lacks a line 'end_header'"},
        {"a.ply", PLY_HEADER("99999999", "1") "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
         "13:7: warning: words after the last property of a row are ignored\n"
         "14:1: error: the file ends before vertex 4 (counted from 0) of 99999999"},
        {"a.ply", PLY_HEADER("3\rcomment\relement face 99999999", "1") "end_header\r\n0 0 0\n",
         "9:9: error: the header declares 'face' twice"},
        {"a.gltf", "{", "1:1: error: the JSON is malformed: string or '}' expected near end of file"},
        {"a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n",
         "4:18: error: a.off: vertex 2 (counted from 0) has a coordinate that is not a number of at most "
         "1e+30 in magnitude"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        file_write(cases[i].name, cases[i].text);
        assert_messages("scene.yaml",
                        formatted(CAMERA_AND_LIGHT "objects:\n  - mesh: {file: %s}\n", cases[i].name),
                        formatted("%s\n", cases[i].message));
    }
}

static void assert_file_refused(const char *name, const char *reason)
{
    assert_messages("scene.yaml", formatted(CAMERA_AND_LIGHT "objects:\n  - mesh: {file: %s}\n", name),
                    formatted("4:18: error: %s: %s\n", name, reason));
}

TEST(other_formats_are_read)
{
    static const char *const endings[] = {"fbx", "dae", "3ds", "off"};
    for (size_t i = 0; i < COUNT_OF(endings); i++) {
        OwnedScene scene =
            scene_of_objects(formatted("  - mesh: {file: %s/triangle.%s}\n", corpus, endings[i]));
        assert_int_equal(scene.meshes.items[0].triangle_count, 1);
    }
}

// A triangle with three normals and texture coordinates, in each format that has both.
static const char smooth_obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn 1 0 0\nvn 0 1 0\n"
                                 "vt 0 0\nvt 1 0.25\nvt 0 1\nf 1/1/1 2/2/2 3/3/3\n";
#define DAE_SOURCE(name, values, count, parameters, size)                                                    \
    "<source id='" name "'><float_array id='" name "f' count='9'>" values "</float_array><technique_common>" \
    "<accessor source='#" name "f' count='" count "' stride='" size "'>" parameters                          \
    "</accessor></technique_common></source>\n"
#define DAE_PARAMETER(name) "<param name='" name "' type='float'/>"
#define DAE_XYZ             DAE_PARAMETER("X") DAE_PARAMETER("Y") DAE_PARAMETER("Z")
static const char smooth_dae[] =
    "<?xml version='1.0'?><COLLADA version='1.4.1'><library_geometries><geometry id='g'><mesh>\n" //
    DAE_SOURCE("p", "0 0 0 1 0 0 0 1 0", "3", DAE_XYZ, "3")                                       //
    DAE_SOURCE("n", "0 0 1 1 0 0 0 1 0", "3", DAE_XYZ, "3")                                       //
    DAE_SOURCE(
        "t", "0 0 1 0.25 0 1 0 0 0", "3", DAE_PARAMETER("S") DAE_PARAMETER("T"),
        "2") "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices><triangles count='1'>"
             "<input semantic='VERTEX' source='#v' offset='0'/><input semantic='NORMAL' source='#n' "
             "offset='0'/>"
             "<input semantic='TEXCOORD' source='#t' offset='0' set='0'/><p>0 1 "
             "2</p></triangles></mesh></geometry>"
             "</library_geometries><library_visual_scenes><visual_scene id='s'><node><instance_geometry "
             "url='#g'/></node>"
             "</visual_scene></library_visual_scenes><scene><instance_visual_scene "
             "url='#s'/></scene></COLLADA>\n";
static const char smooth_fbx[] =
    "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n\tFBXVersion: 7400\n}\n"
    "Objects:  {\n\tGeometry: 1, \"Geometry::a\", \"Mesh\" {\n\t\tVertices: *9 {\n\t\t\ta: "
    "0,0,0,1,0,0,0,1,0\n"
    "\t\t}\n\t\tPolygonVertexIndex: *3 {\n\t\t\ta: 0,1,-3\n\t\t}\n\t\tGeometryVersion: 124\n"
    "\t\tLayerElementNormal: 0 {\n\t\t\tMappingInformationType: \"ByVertice\"\n"
    "\t\t\tReferenceInformationType: \"Direct\"\n\t\t\tNormals: *9 {\n\t\t\t\ta: "
    "0,0,1,1,0,0,0,1,0\n\t\t\t}\n\t\t}\n"
    "\t\tLayerElementUV: 0 {\n\t\t\tName: \"\"\n\t\t\tMappingInformationType: \"ByVertice\"\n"
    "\t\t\tReferenceInformationType: \"Direct\"\n\t\t\tUV: *6 {\n\t\t\t\ta: 0,0,1,0.25,0,1\n\t\t\t}\n\t\t}\n"
    "\t\tLayer: 0 {\n\t\t\tVersion: 100\n\t\t\tLayerElement:  {\n\t\t\t\tType: \"LayerElementNormal\"\n"
    "\t\t\t\tTypedIndex: 0\n\t\t\t}\n\t\t\tLayerElement:  {\n\t\t\t\tType: \"LayerElementUV\"\n"
    "\t\t\t\tTypedIndex: 0\n\t\t\t}\n\t\t}\n\t}\n\tModel: 2, \"Model::a\", \"Mesh\" {\n\t\tVersion: "
    "232\n\t}\n}\n"
    "Connections:  {\n\tC: \"OO\",2,0\n\tC: \"OO\",1,2\n}\n";

// Writes the smooth triangle as glTF, where a texture's origin is the upper left corner.
static void smooth_gltf_write(const char *path)
{
    static const float numbers[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0,     0, 1,
                                    1, 0, 0, 0, 1, 0, 0, 1, 1, 0.75F, 0, 0};
    OwnedText text = {0};
    text_appendf(&text, "%s",
                 "{\"asset\": {\"version\": \"2.0\"}, \"scene\": 0, \"scenes\": [{\"nodes\": [0]}],\n"
                 "\"nodes\": [{\"mesh\": 0}], \"meshes\": [{\"primitives\": [{\"attributes\":\n"
                 "{\"POSITION\": 0, \"NORMAL\": 1, \"TEXCOORD_0\": 2}}]}], \"accessors\": [\n"
                 "{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"},\n"
                 "{\"bufferView\": 1, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"},\n"
                 "{\"bufferView\": 2, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC2\"}],\n"
                 "\"bufferViews\": [{\"buffer\": 0, \"byteLength\": 36},\n"
                 "{\"buffer\": 0, \"byteOffset\": 36, \"byteLength\": 36},\n"
                 "{\"buffer\": 0, \"byteOffset\": 72, \"byteLength\": 24}],\n"
                 "\"buffers\": [{\"byteLength\": 96, \"uri\": \"data:application/octet-stream;base64,");
    base64_append(&text, (const uint8_t *)numbers, sizeof numbers);
    text_appendf(&text, "\"}]}\n");
    file_write(path, text_c(&text));
}

TEST(every_format_has_normals_and_texture_coordinates)
{
    file_write("a.obj", smooth_obj);
    file_write("a.dae", smooth_dae);
    file_write("a.fbx", smooth_fbx);
    smooth_gltf_write("a.gltf");
    OwnedScene scene =
        scene_of_objects("  - mesh: {file: a.obj}\n  - mesh: {file: a.dae}\n  - mesh: {file: a.fbx}\n"
                         "  - mesh: {file: a.gltf}\n");
    for (size_t i = 0; i < scene.meshes.count; i++) {
        const Mesh *mesh = &scene.meshes.items[i];
        assert_non_null(mesh->normals);
        assert_non_null(mesh->uvs);
        assert_int_equal(mesh->triangle_count, 1);
        const uint32_t *corners = mesh->triangles[0];
        assert_vector(mesh->vertices[corners[1]], 1, 0, 0);
        assert_vector(mesh->normals[corners[0]], 0, 0, 1);
        assert_vector(mesh->normals[corners[1]], 1, 0, 0);
        assert_vector(mesh->normals[corners[2]], 0, 1, 0);
        const double uvs[3][2] = {{0, 0}, {1, 0.25}, {0, 1}};
        for (size_t k = 0; k < 3; k++)
            for (size_t axis = 0; axis < 2; axis++)
                assert_number(mesh->uvs[corners[k]][axis], uvs[k][axis]);
    }
}

// Checks what the process that runs assimp may do (tests/assimp_process.c), with lower limits. The caller of
// glint may ignore the signals that end it.
TEST(child_is_limited)
{
    static const struct {
        const char *name, *reason;
    } cases[] = {
        {"crash.fbx", "assimp crashed while reading the file"},
        {"silent.fbx", "assimp failed while reading the file"},
        {"garbage.fbx", "assimp failed while reading the file"},
        {"hang.fbx", "assimp needs more than 60 s of processor time to read the file"},
        {"wait.fbx", "assimp needs more than 120 s to read the file"},
        {"bloat.fbx", "assimp needs more than 4096 MiB to read the file"},
    };
    void (*const on_processor)(int) = signal(SIGXCPU, SIG_IGN),
                 (*const on_alarm)(int) = signal(SIGALRM, SIG_IGN);
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        file_write(cases[i].name, "");
        assert_file_refused(cases[i].name, cases[i].reason);
        unlink(cases[i].name);
    }
    signal(SIGXCPU, on_processor);
    signal(SIGALRM, on_alarm);
}

// Sends a view and warnings as a process that reads a mesh does. Sets *view to the view that arrives. Returns
// whether the reply is sound.
static bool reply_pass(MeshView *sent, size_t warning_count, MeshView *view, MessageList *messages)
{
    const Source source = {.file = "a.fbx", .bytes = ""};
    OwnedMessageList sent_messages = {0};
    FILE *reply = tmpfile();
    assert_non_null(reply);
    bool is_sound = false;
    for (int side = 0; side < 2; side++) {
        Report report = report_open(&source, side == 0 ? &sent_messages : messages);
        OwnedScene scene = {0};
        const MeshImport import = {.path = source.file,
                                   .view = side == 0 ? sent : view,
                                   .report = &report,
                                   .offset = MESSAGE_WHOLE_FILE};
        MeshDraft draft = {.import = &import, .scene = &scene, .source = source, .places = DRAFT_NO_PLACES};
        bool is_read = true;
        for (size_t i = 0; side == 0 && i < warning_count && i < 25; i++)
            draft_warn(&draft, "fault %zu", i);
        if (side == 0) report.warning_count = warning_count;
        if (side == 0)
            assimp_reply_write(&draft, reply, is_read);
        else
            is_sound = assimp_reply_read(&draft, reply, &is_read) && is_read && report_close(&report);
        rewind(reply);
    }
    fclose(reply);
    return is_sound;
}

// A hostile file may control the process that sends the reply.
TEST(a_reply_sets_only_what_assimp_read_sets)
{
    Light light = {.type = LIGHT_POINT, .area = {.type = AREA_SPHERE, .is_visible = true, .radius = NAN}};
    MeshView sent = {.camera = {.half_tangent = 1, .shift = {NAN, 1}, .lens.radius = 1},
                     .has_camera = true,
                     .lights = {&light, 1, 1}},
             view = {.has_camera = false};
    OwnedMessageList messages = {0};
    assert_true(reply_pass(&sent, 0, &view, &messages));
    assert_true(view.has_camera && view.lights.count == 1);
    assert_true(view.camera.half_tangent == 1);
    assert_true(view.camera.shift[0] == 0 && view.camera.shift[1] == 0 && view.camera.lens.radius == 0);
    assert_int_equal(view.lights.items[0].area.type, AREA_NONE);
    assert_true(view.lights.items[0].area.radius == 0);
    free(view.lights.items);
}

TEST(a_reply_counts_the_warnings_beyond_the_limit)
{
    MeshView view = {.has_camera = false};
    OwnedMessageList messages = {0};
    assert_true(reply_pass(&view, 25, &view, &messages));
    assert_int_equal(messages.count, 21);
    assert_string_equal(messages.items[20].text, "5 more warnings are not shown");
    assert_false(reply_pass(&view, SIZE_MAX, &view, &messages));
}

TEST_MAIN(formats_open, formats_close)
