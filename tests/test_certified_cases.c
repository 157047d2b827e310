// Renders at `certified` small scenes with lights on surfaces, checkers far out, paths of little weight, thin
// walls, needles, and sizes from 1e-29 to 1e29 in one scene. Each object, shadow and path must equal the
// reference's, and each color must be within the certified bound. The program takes a pattern of its tests'
// names.
//
// run_tests: sanitize-long-only
#include "host/scene/mesh.h"
#include "tests/certified.h"

// Lights lie above a wall by less than its distance is rounded by, bright ones almost graze it, and others
// are so far from it that the squared distance overflows.
TEST(lights_on_surfaces_are_decided)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    const Object wall = {.type = SHAPE_PLANE, .as.plane = {{0, 0, 0}, {0, 0, 1}}};
    const double heights[] = {1e-5, 1e-7, 1e-9, 1e-12, 1e-15, 1e-20, 1e-30};
    for (size_t i = 0; i < COUNT_OF(heights); i++) {
        Scene scene = scene_seen_from((Vector3){0, 0, 1}, 0.5);
        array_push(scene.objects, wall);
        point_light_add(&scene, (Vector3){0, 0, heights[i]}, 1);
        size_t uncertified = check_small(&scene, 0, "a light above a wall", heights[i]);
        scene = scene_seen_from((Vector3){0, 0, 1}, 0.5);
        array_push(scene.objects, wall);
        array_push(scene.objects, ((Object){.type = SHAPE_SPHERE, .as.sphere = {{0.5, 0, 0}, 0.25}}));
        point_light_add(&scene, (Vector3){10, 0, heights[i]}, 1e6);
        uncertified += check_small(&scene, 0, "a light that grazes a wall", heights[i]);
        if (heights[i] >= 1e-9) assert_int_equal(uncertified, 0); // double distinguishes them
    }
    for (int digits = 15; digits < 24; digits += 2) {
        const double distance = pow(10, digits);
        Scene scene = scene_seen_from((Vector3){0, 0, 0}, 0.5);
        array_push(scene.objects,
                   ((Object){.type = SHAPE_PLANE, .as.plane = {{0, 0, -distance}, {0, 0, 1}}}));
        point_light_add(&scene, (Vector3){0, 0, fmin(distance, 5e17)}, 1);
        assert_int_equal(check_small(&scene, 0, "a wall far from the light", distance), 0);
    }
}

// Checkers surround an eye far from the origin for their size, on level and tilted walls and on a box.
TEST(checkers_far_out_are_decided)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    for (int digits = 3; digits < 13; digits += 2)
        for (unsigned form = 0; form < 3; form++) {
            const double far = pow(10, digits);
            const double size = far < 1e7 ? 1e-14 * far : 0.1; // of a view zoomed in, and of an ordinary one
            const Vector3 from = {far + 0.3 * size, -3 * far - 0.4 * size, 7 * far};
            Scene scene = scene_seen_from(from, 3 * size);
            scene.camera.look_at.z = from.z - 1;
            Material *material = &scene.materials.items[0];
            material->checker.is_on = true;
            material->checker.size = size;
            material->checker.colors[0] = (Color){1, 1, 1};
            scene.ambient = (Color){1, 1, 1};
            material->ambient = 1;
            const Vector3 point = {from.x, from.y, from.z - 1};
            const Vector3 normal = {form, 0.5 * form, 3};
            Object object = {.type = SHAPE_PLANE, .as.plane = {point, normal}};
            if (form == 2)
                object = (Object){
                    .type = SHAPE_BOX,
                    .as.box = {{from.x - 5, from.y - 5, from.z - 2}, {from.x + 5, from.y + 5, from.z - 1}}};
            array_push(scene.objects, object);
            assert_true(check_small(&scene, 0, "a checker far out", far) < 2 * SMALL_SIDE);
        }
}

// Mirrors and glass leave so little of the light that a product of their parts underflows. No path ends
// before it has all its bounces, and no shadow is full.
TEST(faint_paths_are_decided)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    const double parts[] = {0.5, 1e-3, 1e-20, 1e-50};
    for (size_t i = 0; i < COUNT_OF(parts); i++) {
        Scene scene = scene_seen_from((Vector3){0, 0, 0}, 0.5);
        scene.materials.items[0].reflection.largest = parts[i];
        for (int side = -1; side <= 1; side += 2)
            array_push(scene.objects, ((Object){.type = SHAPE_PLANE, .as.plane = {{0, 0, side}, {0, 0, 1}}}));
        const uint32_t bounces = tests_are_long() ? 40 : 8; // with more, a kernel keeps more pending rays
        assert_true(check_small(&scene, bounces, "facing mirrors", parts[i]) < SMALL_SIDE);
        scene = scene_seen_from((Vector3){0, 0, 0}, 0.5);
        point_light_add(&scene, (Vector3){0, 0, 3}, 1);
        array_push(scene.materials, scene.materials.items[0]);
        scene.materials.items[1].transmission.largest = parts[i];
        array_push(scene.objects, ((Object){.type = SHAPE_PLANE, .as.plane = {{0, 0, -9}, {0, 0, 1}}}));
        for (int k = 0; k < 8; k++) // one after another in view, and on the way to the light
            array_push(scene.objects, ((Object){.type = SHAPE_PLANE,
                                                .material = 1,
                                                .as.plane = {{0, 0, k < 4 ? -1 - k : k / 4.0}, {0, 0, 1}}}));
        assert_true(check_small(&scene, 6, "panes of glass", parts[i]) < SMALL_SIDE);
    }
}

// A plane whose normal is not a float is seen at angles that float cannot distinguish from 0, so that only
// double decides where the horizon is.
TEST(skimming_rays_are_decided)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    for (int digits = 7; digits < 13; digits++) {
        const Vector3 normal = {0.1, 0.7, 0};
        Scene scene = scene_seen_from((Vector3){0, 0, 0}, pow(10, -digits));
        array_push(scene.objects, ((Object){.type = SHAPE_PLANE, .as.plane = {{-3.5, -0.5, 0}, normal}}));
        assert_true(check_small(&scene, 0, "a plane that rays skim", digits) < 2 * SMALL_SIDE);
    }
}

// Bubbles have walls of glass, some of them thinner than the distance at which rays through them start off a
// surface, except at certified. `single`, and in long tests `strict`, shows walls above the bound that
// docs/numerics.md states.
TEST(thin_walls_are_decided)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    const Vector3 center = {0.3, 0.2, -5};
    const double stated = 3 * 0x1p-24 * (16 * (1 + 5.5) + 4 * 6);
    for (int i = 0; i < 4; i++) {
        const double wall = i == 0 ? stated : pow(10, -3 - 2 * i);
        Scene scene = scene_seen_from((Vector3){0, 0, 0}, 0.2);
        Material *material = &scene.materials.items[0];
        material->transmission.largest = 0.9;
        material->ior = 1.5;
        array_push(scene.materials, scene.materials.items[0]);
        scene.materials.items[1].ior = 1 / 1.5;
        array_push(scene.objects, ((Object){.type = SHAPE_SPHERE, .as.sphere = {center, 1}}));
        array_push(scene.objects,
                   ((Object){.type = SHAPE_SPHERE, .material = 1, .as.sphere = {center, 1 - wall}}));
        RenderSettings settings = film_settings(SMALL_SIDE, SMALL_SIDE, PRECISION_SINGLE);
        settings.bounce_count = 6;
        OwnedCertifySample reference;
        assert_true(certify_sample_open(&reference, &scene, &settings, SMALL_SIDE * SMALL_SIDE));
        const Precision last = tests_are_long() ? PRECISION_STRICT : PRECISION_SINGLE;
        for (; settings.precision <= last; settings.precision++) {
            const DecisionCounts found = decisions_count(&scene, &reference, &settings);
            assert_int_equal(found.wrong == 0, i == 0);
        }
        assert_true(check_small(&scene, 6, "a bubble with a thin wall", wall) < SMALL_SIDE);
    }
}

// The edges of triangles round to one line, though they have an area. The triangles are strips across the
// view from corners far away, and needles.
TEST(needles_have_an_area)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    for (int digits = 3; digits < 31; digits += 3) {
        const double far = pow(10, digits);
        Scene scene = scene_seen_from((Vector3){0, 0, 0}, 0.5);
        scene.materials.items[0].ambient = 1;
        array_push(scene.objects,
                   ((Object){.type = SHAPE_TRIANGLE,
                             .as.triangle.vertices = {{far, far, -1}, {0, 0, -1}, {0.25, 0, -1}}}));
        RenderSettings settings = film_settings(SMALL_SIDE, SMALL_SIDE, PRECISION_DOUBLE);
        OwnedFilm film = film_render(&probe_compute, &scene, &settings, 0);
        size_t seen = 0;
        for (size_t i = 0; i < SMALL_SIDE * SMALL_SIDE; i++)
            seen += film.color[3 * i] != 0.25; // not the background
        assert_int_not_equal(seen, 0);
        const size_t uncertified = check_small(&scene, 0, "a strip", far);
        if (far < 1e13) assert_true(uncertified < 3 * SMALL_SIDE); // farther off all may be
    }
    for (unsigned seed = 0; seed < 20; seed++) {
        random_state.state = seed;
        Scene scene = scene_seen_from((Vector3){0, 0, 0}, 0.5);
        for (int i = 0; i < 20; i++) {
            const Vector3 way = random_unit_vector(&random_state), end = {way.x, way.y, -2 + way.z},
                          middle = vector_scale(end, random_between(&random_state, 0.2, 0.8));
            const double off = random_power(&random_state, -20, -3);
            const Vector3 beyond = {nextafter(2 * end.x, 9), 2 * end.y, 2 * end.z};
            array_push(scene.objects,
                       ((Object){.type = SHAPE_TRIANGLE,
                                 .as.triangle.vertices = {
                                     vector_add(middle, vector_scale(random_unit_vector(&random_state), off)),
                                     end, beyond}}));
        }
        point_light_add(&scene, (Vector3){3, 3, 3}, 1);
        assert_int_equal(check_small(&scene, 0, "needles", seed), 0);
    }
}

// Returns a sheet across the view, cut into ribbons a thousand times as long as wide. Each triangle has
// another plane.
static Mesh ribbons_in_view(void)
{
    enum { RIBBONS = 250 };
    Mesh mesh = {.vertices = memory_allocate(2 * (RIBBONS + 1), sizeof *mesh.vertices),
                 .triangles = memory_allocate(2 * RIBBONS, sizeof *mesh.triangles)};
    const Vector3 center = {0, 0, -3}, right = {2.1, 0.3, 0.4}, up = {-0.2, 0.6, 0.1};
    for (uint32_t i = 0; i <= RIBBONS; i++) {
        for (int side = -1; side <= 1; side += 2) {
            const Vector3 way =
                              vector_add(vector_scale(right, side), vector_scale(up, 2.0 * i / RIBBONS - 1)),
                          off = vector_scale(random_unit_vector(&random_state), 1e-5);
            mesh.vertices[mesh.vertex_count++] = vector_add(vector_add(center, way), off);
        }
        if (i == 0) continue;
        const uint32_t last = (uint32_t)mesh.vertex_count - 1;
        const uint32_t parts[2][3] = {{last - 3, last - 2, last - 1}, {last, last - 1, last - 2}};
        memcpy(mesh.triangles[mesh.triangle_count], parts, sizeof parts);
        mesh.triangle_count += 2;
    }
    return mesh;
}

// Ribbons form mirrors, glass and a checkered wall. Rounded to float, the vertices have other planes, which
// would show other squares. An image and its AOVs take three samples per pixel.
TEST(slim_triangles_are_seldom_rerendered)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    enum { SIDE = 20 };
    for (unsigned seed = 0; seed < 2; seed++) {
        random_state.state = seed;
        const bool is_mirror = seed == 0;
        OwnedScene scene = scene_seen_from((Vector3){0, 0, 0}, 0.2);
        array_push(scene.materials, material_default());
        Material *sheet = &scene.materials.items[0], *wall = &scene.materials.items[1];
        *(is_mirror ? &sheet->reflection.largest : &sheet->transmission.largest) = 0.8;
        sheet->ior = 1.5;
        wall->checker.is_on = true;
        wall->checker.size = 0.05;
        wall->checker.colors[0] = (Color){1, 1, 1};
        wall->ambient = 1;
        array_push(scene.meshes, ribbons_in_view());
        array_push(scene.objects, ((Object){.type = SHAPE_MESH}));
        array_push(scene.objects, ((Object){.type = SHAPE_PLANE,
                                            .material = 1,
                                            .as.plane = {{0, 0, is_mirror ? 20 : -20}, {0.1, 0.2, 1}}}));
        point_light_add(&scene, (Vector3){3, 5, 0}, 1);
        RenderSettings settings = film_settings(SIDE, SIDE, PRECISION_CERTIFIED);
        settings.bounce_count = 2;
        OwnedCertifySample reference;
        assert_true(certify_sample_open(&reference, &scene, &settings, SIDE * SIDE));
        const DecisionCounts found = decisions_count(&scene, &reference, &settings);
        print_message("%zu of %u samples re-rendered\n", (size_t)found.rerendered, 3 * SIDE * SIDE);
        assert_int_equal(found.violations, 0);
        assert_true(found.rerendered < 64);
    }
}

// Single certifies most pixels of a ball of 40,000 smooth triangles with waves, although rays to lights
// start close to other triangles.
TEST(fine_meshes_are_seldom_rerendered)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    enum { AROUND = 200, DOWN = 100 };
    Mesh mesh = {.vertices = memory_allocate(AROUND * (DOWN + 1), sizeof *mesh.vertices),
                 .triangles = memory_allocate(2 * AROUND * DOWN, sizeof *mesh.triangles)};
    for (uint32_t row = 0; row <= DOWN; row++)
        for (uint32_t i = 0; i < AROUND; i++) {
            const double down = M_PI * (row + 0.5) / (DOWN + 1), round = 2 * M_PI * i / AROUND;
            const double radius = 1 + 0.02 * sin(17 * round) * sin(13 * down);
            mesh.vertices[mesh.vertex_count++] = (Vector3){
                radius * sin(down) * cos(round), radius * cos(down), radius * sin(down) * sin(round) - 5};
            if (row == 0) continue;
            const uint32_t here = row * AROUND + i, next = row * AROUND + (i + 1) % AROUND;
            const uint32_t parts[2][3] = {{here - AROUND, next - AROUND, here}, {next - AROUND, next, here}};
            memcpy(mesh.triangles[mesh.triangle_count], parts, sizeof parts);
            mesh.triangle_count += 2;
        }
    mesh_make_normals(&mesh);
    OwnedScene scene = scene_seen_from((Vector3){0, 0, 0}, 0.25);
    array_push(scene.meshes, mesh);
    array_push(scene.objects, ((Object){.type = SHAPE_MESH}));
    point_light_add(&scene, (Vector3){6, 5, -3}, 1);
    RenderSettings settings = small_settings(0);
    settings.width = settings.height = settings.region_width = settings.region_height = 100;
    OwnedFilm film = image_render(&scene, &settings);
    print_message("%zu of %u pixels re-rendered\n", (size_t)film.rerenders.rerendered, 100 * 100);
    size_t seen = 0;
    for (size_t i = 0; i < 100 * 100; i++)
        seen += film.color[3 * i] != 0.25; // not the background
    assert_true(seen > 5000 && film.rerenders.rerendered > 0 && film.rerenders.rerendered < 60);
}

// Returns a shape of this size in front of the eye.
static Object shape_of_size(unsigned form, double size)
{
    const Vector3 center = {0.3 * size, 0.2 * size, -4 * size}, axis = {0.3 * size, size, 0.7 * size};
    switch (form) {
    case 0:
        return (Object){.type = SHAPE_SPHERE, .as.sphere = {center, size}};
    case 1:
        return (Object){.type = SHAPE_DISC, .as.disc = {center, axis, size}};
    case 2:
        return (Object){.type = SHAPE_CYLINDER, .as.cylinder = {center, axis, size, true, true}};
    case 3:
        return (Object){.type = SHAPE_CONE, .as.cone = {center, axis, {size, 0.3 * size}, 0, true, true}};
    case 4:
        return (Object){.type = SHAPE_PARABOLOID,
                        .as.paraboloid = {center, axis, 0.25 * size, 1.5 * size, .finite = true}};
    case 5:
        return (Object){.type = SHAPE_TORUS, .as.torus = {center, axis, size, 0.4 * size}};
    case 6:
        return (Object){.type = SHAPE_SUPERELLIPSOID,
                        .as.superellipsoid = {center, {{size, 0, 0}, {0, size, 0}, {0, 0, 0.6 * size}}, 6}};
    case 7:
        return (Object){.type = SHAPE_TRIANGLE,
                        .as.triangle.vertices = {center, vector_add(center, axis), {0, 0, center.z}}};
    default:
        return (Object){.type = SHAPE_BOX, .as.box = {vector_subtract(center, vector_all(size)), center}};
    }
}
enum { FORMS = 9 };

// Shapes from 1e-29 to 1e29 are seen from close by, alone and with one of another size in the same scene.
TEST(mixed_sizes_are_decided)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    const int steps = tests_are_long() ? 10 : 2; // on either side of 1
    size_t uncertified = 0, count = 0;
    for (unsigned form = 0; form < FORMS; form++)
        for (int i = -steps; i <= steps; i++)
            for (int k = -steps; k <= steps; k++) {
                if (!tests_are_long() && (unsigned)(k + i + 2 * steps) % 4 != form % 4) continue;
                const int exponent = i * 29 / steps, other = k * 29 / steps;
                const double size = pow(10, exponent);
                Scene scene = scene_seen_from((Vector3){0, 0, 0}, 0.5);
                array_push(scene.objects, shape_of_size(form, size));
                if (other != exponent) array_push(scene.objects, shape_of_size(FORMS - 1, pow(10, other)));
                array_push(scene.lights, ((Light){.type = LIGHT_DIRECTIONAL,
                                                  .color = {0.5, 0.5, 0.5},
                                                  .direction = {-3, -5, -1}}));
                uncertified += check_small(&scene, 0, shape_names[scene.objects.items[0].type], exponent);
                count++;
            }
    print_message("%zu pixels uncertified of %zu\n", uncertified, count * SMALL_SIDE * SMALL_SIDE);
    assert_true(uncertified * 16 < count * SMALL_SIDE * SMALL_SIDE);
}

// A planet with a hill and a tower, a light and an eye close above the ground, at a scale of 2^-34 to 2^40.
TEST(planets_of_every_scale_are_decided)
{
    if (!probe_has(PRECISION_CERTIFIED)) skip();
    const int exponents[] = {-34, -30, 0, 30, 40};
    size_t uncertified = 0;
    for (size_t i = 0; i < COUNT_OF(exponents); i++)
        for (int digits = 4; digits < 7; digits++) {
            const double unit = exp2(exponents[i]), radius = pow(10, digits) * unit,
                         away = sqrt(2 * radius * unit);
            Scene scene = scene_seen_from((Vector3){0, 0, 0}, 0.3);
            const Vector3 center = {0, -radius - 1.1 * unit, -0.3 * unit},
                          foot = {0.1 * away, -2.1 * unit, -0.9 * away};
            array_push(scene.objects, ((Object){.type = SHAPE_SPHERE, .as.sphere = {center, radius}}));
            array_push(scene.objects,
                       ((Object){.type = SHAPE_SPHERE,
                                 .as.sphere = {{-0.7 * unit, -1.2 * unit, -5 * unit}, 0.6 * unit}}));
            array_push(scene.objects, ((Object){.type = SHAPE_CYLINDER,
                                                .as.cylinder = {.from = foot,
                                                                .axis = {0, 0.1 * away, 0},
                                                                .radius = 0.02 * away,
                                                                .finite = true}}));
            point_light_add(&scene, (Vector3){0.6 * unit, 0.4 * unit, -unit}, 1);
            uncertified += check_small(&scene, 0, "a planet", exponents[i]);
        }
    assert_int_equal(uncertified, 0);
}

TEST_MAIN(probe_open, probe_close)
