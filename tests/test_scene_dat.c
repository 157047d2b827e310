// Reads Tachyon's `.dat` scenes. Tests every statement's values in glint's coordinates, what glint does not
// show, and an image against Tachyon's own pixels.
#include "host/import/load.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

#define CAMERA_OF(projection, end)                                                                           \
    "camera " projection " zoom 1 aspectratio 1 antialiasing 0 raydepth 8\ncenter 0 0 -5 viewdir 0 0 1 "     \
    "updir 0 1 0 " end "end_camera\n"
#define BEGIN    "begin_scene\nresolution 8 8\n"
#define LIT      BEGIN CAMERA_OF("", "") "directional_light direction 0 0 1 color 1 1 1\n"
#define TEXTURE  "texture ambient 0 diffuse 1 specular 0 opacity 1 color 1 1 1 texfunc 0\n"
#define SPHERE   "sphere center 0 0 0 rad 1 " TEXTURE
#define OF(keys) "texture ambient 0 diffuse 1 specular 0 opacity 1 " keys "\n"

static int set_up(void **state)
{
    return complete_open("tests/scenes/complete.dat") + probe_open(state);
}

static int tear_down(void **state)
{
    return complete_close(state) + probe_close(state);
}

// z is negated.
TEST(camera)
{
    const Camera *camera = &complete.camera;
    assert_int_equal(complete.width, 640);
    assert_int_equal(complete.height, 480);
    assert_int_equal(complete.color_meaning, COLORS_DISPLAY);
    assert_vector(complete.background, 0.1, 0.2, 0.3);
    assert_vector(camera->position, 1, 2, 5);
    const Vector3 forward = vector_normalize(vector_subtract(camera->look_at, camera->position));
    assert_vector(forward, 0, 0.6, -0.8);
    assert_vector(camera->up, 0, 1, -0.5);
    assert_int_equal(camera->field_axis, FIELD_VERTICAL);
    assert_number(camera->half_tangent, 0.25);
    assert_number(camera->frame_aspect, 2);
    OwnedScene scene = scene_of_text("s.dat", LIT SPHERE);
    assert_number(scene.camera.half_tangent, 0.5);
    assert_number(scene.camera.frame_aspect, 0);
}

TEST(lights)
{
    const Light *lights = complete.lights.items;
    assert_vector(complete.ambient, 1, 1, 1);
    assert_int_equal(complete.lights.count, 5);
    assert_int_equal(lights[0].type, LIGHT_POINT);
    assert_vector(lights[0].position, 1, 2, -3);
    assert_vector(lights[0].color, 0.5, 0.25, 1);
    assert_vector(lights[1].color, 0.5, 0.5, 0.25);
    assert_int_equal(lights[2].type, LIGHT_DIRECTIONAL);
    assert_vector(lights[2].direction, 1, -2, -3);
    assert_int_equal(lights[3].type, LIGHT_SPOT);
    assert_vector(lights[3].direction, 0, -1, -0.5);
    assert_number(lights[3].spot.half_angle, 45);
    assert_number(lights[3].spot.penumbra, 25);
    assert_vector(lights[4].color, 0.25, 0, 0);
}

TEST(materials)
{
    const Material *plastic = material_of(&complete.objects.items[0]),
                   *green = material_of(&complete.objects.items[2]),
                   *blue = material_of(&complete.objects.items[8]);
    assert_vector(plastic->color, 1, 0.5, 0.25);
    assert_number(plastic->ambient, 0.1);
    assert_vector(plastic->diffuse, 0.6, 0.6, 0.6);
    assert_number(plastic->reflection.largest, 0.2);
    assert_number(plastic->transmission.largest, 0.25);
    assert_number(plastic->ior, 1);
    assert_number(plastic->specular.largest, 0.5);
    assert_number(plastic->shininess, 10);
    assert_ptr_equal(material_of(&complete.objects.items[1]), plastic);
    assert_vector(green->color, 0, 1, 0);
    assert_number(green->specular.largest, 0);
    assert_vector(blue->color, 0, 0, 1);
    assert_number(blue->specular.largest, 0.5);

    // as VMD has it, what a transparent surface shows is dimmed
    OwnedScene scene = scene_of_text(
        "s.dat",
        LIT "shader_mode full trans_vmd end_shader_mode sphere center 0 0 0 rad 1 texture ambient 0.4 "
            "diffuse 0.8 specular 0 opacity 0.25 phong 1 phong_size 8 color 1 1 1 texfunc 0\n");
    const Material *dimmed = &scene.materials.items[0];
    assert_number(dimmed->ambient, 0.1);
    assert_vector(dimmed->diffuse, 0.2, 0.2, 0.2);
    assert_number(dimmed->specular.largest, 0.25);
    assert_number(dimmed->transmission.largest, 0.75);
}

TEST(shapes)
{
#define CORNERS                                                                                              \
    {                                                                                                        \
        {0, 0, -1}, {1, 0, -2},                                                                              \
        {                                                                                                    \
            0, 1, -3                                                                                         \
        }                                                                                                    \
    }
#define NORMALS                                                                                              \
    {                                                                                                        \
        {1, 0, -1}, {0, 1, -1},                                                                              \
        {                                                                                                    \
            0, 0, -1                                                                                         \
        }                                                                                                    \
    }
    static const Object expected[] = {
        {SHAPE_SPHERE, .as.sphere = {{1, 2, -3}, 4}},
        {SHAPE_PLANE, .as.plane = {{1, 2, -3}, {0, 1, -2}}},
        {SHAPE_CYLINDER, .as.cylinder = {{1, 2, -3}, {1, 0, 1}, 0.5}},
        {SHAPE_CYLINDER, .as.cylinder = {{1, 2, -3}, {0, 2, -1}, 0.5, .finite = true}},
        {SHAPE_DISC, .as.disc = {{1, 2, -3}, {0, 0, -2}, 3}},
        {SHAPE_BOX, .as.box = {{1, 2, -6}, {4, 5, -3}}},
        {SHAPE_TRIANGLE, .as.triangle.vertices = CORNERS},
        {SHAPE_TRIANGLE, .as.triangle = {CORNERS, NORMALS, .smooth = true}},
        {SHAPE_TRIANGLE, .as.triangle = {CORNERS, NORMALS, .smooth = true}},
        // a polycylinder
        {SHAPE_SPHERE, .as.sphere = {{0, 0, 0}, 0.25}},
        {SHAPE_SPHERE, .as.sphere = {{0, 1, -1}, 0.25}},
        {SHAPE_CYLINDER, .as.cylinder = {{0, 1, -1}, {0, -1, 1}, 0.25, .finite = true}},
        {SHAPE_SPHERE, .as.sphere = {{1, 1, -2}, 0.25}},
        {SHAPE_CYLINDER, .as.cylinder = {{1, 1, -2}, {-1, 0, 1}, 0.25, .finite = true}},
    };
    assert_int_equal(complete.objects.count, 16);
    check_shapes(complete.objects.items, expected, COUNT_OF(expected));
}

TEST(meshes)
{
    const Object *ring = &complete.objects.items[14], *array = &complete.objects.items[15];
    assert_int_equal(ring->type, SHAPE_MESH);
    const Mesh *mesh = &complete.meshes.items[ring->as.mesh.index];
    assert_int_equal(mesh->triangle_count, 512);
    double area = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *corners = mesh->triangles[i];
        const Vector3 a = mesh->vertices[corners[0]];
        area += vector_length(vector_cross(vector_subtract(mesh->vertices[corners[1]], a),
                                           vector_subtract(mesh->vertices[corners[2]], a))) /
                2;
        assert_number(a.z, -3);
    }
    assert_near(area, M_PI * (9 - 1), 1e-2);

    static const struct {
        uint32_t corners[3];
        Color color;
    } triangles[] = {{{0, 1, 2}, {1, 1, 1}},
                     {{1, 0, 3}, {1, 0, 0}}, // a strip's triangles turn alike
                     {{3, 0, 2}, {1, 0, 0}},
                     {{0, 1, 2}, {0, 1, 0}},
                     {{1, 3, 4}, {0, 1, 0}}};
    static const Vector3 vertices[] = {{0, 0, -1}, {1, 0, -1}, {0, 1, -1}, {1, 1, -1}, {2, 2, -2}};
    mesh = &complete.meshes.items[array->as.mesh.index];
    assert_int_equal(mesh->triangle_count, COUNT_OF(triangles));
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const Color color = complete.materials.items[mesh->materials[i]].color, expected = triangles[i].color;
        assert_vector(color, expected.x, expected.y, expected.z);
        for (size_t k = 0; k < 3; k++) {
            const Vector3 vertex = mesh->vertices[mesh->triangles[i][k]],
                          wanted = vertices[triangles[i].corners[k]];
            assert_vector(vertex, wanted.x, wanted.y, wanted.z);
            const double facing = triangles[i].corners[k] < 4; // of length 1, or none
            assert_vector(mesh->normals[mesh->triangles[i][k]], 0, 0, facing);
        }
    }
}

#define WARNS(text, expected) assert_messages("s.dat", LIT SPHERE text, expected)

TEST(losses)
{
    WARNS("", "");
    WARNS("fog exp2 start 0 end 9 density 0.2 color 0 0 0\nfog off start 0 end 9 density 0 color 0 0 "
          "0\n" SPHERE,
          "7:1: warning: 'fog' is not shown\n");
    WARNS("include sphere\nimagedef a format rgb24 resolution 1 1 1 encoding hex fff\n" SPHERE
          "start_clipgroup numplanes 1 1 0 0 0\n" SPHERE "end_clipgroup\n",
          "7:1: warning: 'include' is not shown\n8:1: warning: 'imagedef' is not shown\n"
          "10:1: warning: 'start_clipgroup' is not shown\n");
    WARNS("sphere center 0 0 0 rad 1 " OF(
              "transmode vmd outline 0 outline_width 0 color 1 1 1 texfunc 0") "sphere center 0 0 0 rad "
                                                                               "1 " OF("transmode r3d "
                                                                                       "outline 1 "
                                                                                       "outline_width 1 "
                                                                                       "color 1 1 1 texfunc "
                                                                                       "0"),
          "8:86: warning: 'transmode r3d' is ignored; opacity does not depend on the angle\n"
          "8:98: warning: outlines are not shown\n");
    WARNS("sphere center 0 0 0 rad 1 " OF(
              "phong metal 1 phong_size 9 color 0.5 0.25 0 texfunc 1 center 0 0 0 "
              "rotate 0 0 0 scale 1 1 1") "sphere center 0 0 0 rad 1 " OF("color 1 1 1 texfunc 9 a.ppm "
                                                                          "center 0 0 0 rotate 0 0 0 scale 1 "
                                                                          "1 1 uaxis 1 0 0 vaxis 0 1 0"),
          "7:82: warning: highlights have the light's color, not that of metal\n"
          "7:128: warning: texfunc 1 is not supported; the color is used\n"
          "8:96: warning: texfunc 9 is not supported; the color is used\n");
    WARNS("sphere center 0 0 0 rad 1 unknown\nsphere center 0 0 0 rad 1 unknown\n",
          "7:27: warning: unknown texture 'unknown'; white is used\n");
    WARNS("sphere center 0 0 0 rad 0 " TEXTURE "fcylinder base 0 0 0 apex 0 0 0 rad 1 " TEXTURE
          "plane center 0 0 0 normal 0 0 0 " TEXTURE,
          "7:1: warning: a sphere without size or direction is not shown\n"
          "8:1: warning: a cylinder without size or direction is not shown\n"
          "9:1: warning: a plane without size or direction is not shown\n");
    WARNS("vcstri v0 0 0 0 v1 1 0 0 v2 0 1 0 n0 0 0 1 n1 0 0 1 n2 0 0 1 c0 1 0 0 c1 0 1 0 c2 0 0 1 ambient 0 "
          "diffuse 1 specular 0 opacity 1 vcst\n",
          "7:1: warning: triangles have the mean of the colors of their vertices\n");
    WARNS("sphere center 0 0 0 rad 1 texture ambient -1 diffuse 1 specular 7 opacity 1.5 color 1 -1 1 "
          "texfunc 0\n",
          "7:43: warning: 'ambient' must be 0 or more, not -1; the default is used\n"
          "7:65: warning: 'specular' must be from 0 to 1, not 7; the default is used\n"
          "7:75: warning: 'opacity' must be from 0 to 1, not 1.5; the default is used\n"
          "7:85: warning: each number of 'color' must be 0 or more; the default is used\n");
    WARNS("shader_mode medium shadow_filter_off ambient_occlusion ambient_color 1 1 1 rescale_direct 0.3 "
          "samples "
          "9 trans_raster3d end_shader_mode\n",
          "7:13: warning: shader mode 'medium' omits effects such as shadows; the scene is rendered with all "
          "of them\n"
          "7:20: warning: 'shadow_filter_off' is ignored; transparent objects cast shadows\n"
          "7:56: warning: ambient occlusion is not shown\n"
          "7:105: warning: 'trans_raster3d' is ignored; opacity does not depend on the angle\n");
    assert_messages("s.dat", BEGIN CAMERA_OF("projection fisheye", "") SPHERE,
                    "3:19: warning: the fisheye projection is not supported; perspective is used\n"
                    "warning: the scene has no lights, so only ambient light and emission are shown\n");
}

TEST(fading)
{
    const char *text = BEGIN CAMERA_OF("", "") SPHERE
        "sphere center 0 4 0 rad 1 " TEXTURE
        "light center 3 2 0 rad 0.1 attenuation constant 1 linear 2 quadratic 1 color 1.6 0 0\n";
    assert_messages("s.dat", text, "7:20: warning: the radius of lights is ignored; they are not visible\n");
    OwnedScene scene = scene_of_text("s.dat", text);
    assert_vector(scene.lights.items[0].color, 1.6, 0, 0);
    const double *fading = scene.lights.items[0].fading;
    assert_true(fading[0] == 1 && fading[1] == 2 && fading[2] == 1);
}

TEST(frustum)
{
    OwnedScene scene = scene_of_text("s.dat", BEGIN CAMERA_OF("", "frustum -1 2 -3 1 ") SPHERE);
    assert_number(scene.camera.half_tangent, 2);
    assert_number(scene.camera.frame_aspect, 0.75);
    assert_number(scene.camera.shift[0], 0.125);
    assert_number(scene.camera.shift[1], -0.25);
}

TEST(orthographic)
{
    OwnedScene scene = scene_of_text("s.dat", BEGIN CAMERA_OF("projection orthographic", "") SPHERE);
    assert_true(scene.camera.projection == PROJECTION_ORTHOGRAPHIC);
    assert_number(scene.camera.half_tangent, 0.5);
}

// Colors of Tachyon 0.99, whose rays go through a pixel's upper right corner, where four pixels of the double
// resolution meet.
TEST(picture)
{
    static const char text[] = "begin_scene resolution 40 30\n" CAMERA_OF(
        "", "") "directional_light direction 0.5 -1 1 color 0.9 0.8 0.7\nbackground 0.1 0.2 0.3\n"
                "plane center 0 -1 0 normal 0 1 0 texture ambient 0.1 diffuse 0.8 specular 0.25 opacity 1 "
                "color 0.8 0.8 0.7 "
                "texfunc 0\n"
                "sphere center -1 0.2 0 rad 1 texture ambient 0.1 diffuse 0.7 specular 0 opacity 1 phong "
                "plastic 0.4 "
                "phong_size 20 color 1 0.3 0.2 texfunc 0\n"
                "fcylinder base 1.5 -1 0 apex 1.2 1 0.5 rad 0.4 texture ambient 0.2 diffuse 0.5 specular 0 "
                "opacity 1 color 0.2 "
                "0.4 1 texfunc 0\nend_scene\n";
    static const struct {
        unsigned x, y;
        double color[3];
    } pixels[] = {
        {2, 2, {0.100, 0.200, 0.300}},   {12, 10, {0.873, 0.367, 0.271}}, {15, 12, {0.469, 0.134, 0.083}},
        {10, 14, {0.561, 0.175, 0.114}}, {14, 18, {0.100, 0.030, 0.020}}, {27, 11, {0.107, 0.200, 0.462}},
        {28, 12, {0.088, 0.165, 0.386}}, {22, 22, {0.489, 0.471, 0.406}}, {5, 26, {0.489, 0.471, 0.406}},
        {28, 25, {0.492, 0.474, 0.453}}, {15, 27, {0.492, 0.430, 0.337}}, {17, 26, {0.489, 0.429, 0.336}},
        {24, 18, {0.489, 0.471, 0.406}}};
    OwnedScene scene = scene_of_text("s.dat", text);
    enum { WIDTH = 80, HEIGHT = 60 };
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
    OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
    for (size_t i = 0; i < COUNT_OF(pixels); i++) {
        const double *corner = film.color + 3 * ((2 * pixels[i].y - 1) * WIDTH + 2 * pixels[i].x + 1);
        for (size_t k = 0; k < 3; k++)
            assert_near((corner[k] + corner[k + 3] + corner[k + 3 * WIDTH] + corner[k + 3 * WIDTH + 3]) / 4,
                        pixels[i].color[k], 0.02);
    }
}

TEST_MAIN(set_up, tear_down)
