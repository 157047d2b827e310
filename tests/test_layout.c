// Checks that the structs that host and kernels share have the same layout on both sides. Compares their
// sizes and the places of their members, as the device's compiler has them in float and in double, and their
// values after the host's narrowing.
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

// The widths of nodes and blocks are their kernel's: these are those of one lane.
typedef struct {
    scalar4 planes[BVH_PLANES];
    uint4 child_index[1], child_type[1];
} BvhNode;

typedef struct {
    scalar4 rows[BLOCK_ROWS];
} TriangleBlock;

typedef struct {
    scalar4 rows[SPHERE_ROWS];
    uint4 ids[1], indices[1];
} SphereBlock;

// Every member of every struct: its type in the flat arrays, the struct, the member. REALS are scalar4,
// INTEGERS uint4. In a shape only the last member, its id, is listed.
// clang-format off
#define MEMBER_LIST(REALS, INTEGERS)                                             \
    REALS(FLAT_HEADER, SceneHeader, background)                                  \
    REALS(FLAT_HEADER, SceneHeader, ambient)                                     \
    REALS(FLAT_HEADER, SceneHeader, sky_up)                                      \
    REALS(FLAT_HEADER, SceneHeader, sky_above)                                   \
    REALS(FLAT_HEADER, SceneHeader, sky_below)                                   \
    REALS(FLAT_HEADER, SceneHeader, sky_forward)                                 \
    REALS(FLAT_HEADER, SceneHeader, sky_right)                                   \
    REALS(FLAT_HEADER, SceneHeader, eye)                                         \
    REALS(FLAT_HEADER, SceneHeader, forward)                                     \
    REALS(FLAT_HEADER, SceneHeader, lens_right)                                  \
    REALS(FLAT_HEADER, SceneHeader, lens_up)                                     \
    REALS(FLAT_HEADER, SceneHeader, right)                                       \
    REALS(FLAT_HEADER, SceneHeader, up)                                          \
    REALS(FLAT_HEADER, SceneHeader, bounds)                                      \
    REALS(FLAT_HEADER, SceneHeader, bounds_low)                                  \
    REALS(FLAT_HEADER, SceneHeader, bounds_high)                                 \
    REALS(FLAT_HEADER, SceneHeader, contact_low)                                 \
    REALS(FLAT_HEADER, SceneHeader, contact_high)                                \
    REALS(FLAT_HEADER, SceneHeader, sample)                                      \
    INTEGERS(FLAT_HEADER, SceneHeader, image)                                    \
    INTEGERS(FLAT_HEADER, SceneHeader, bounces)                                  \
    INTEGERS(FLAT_HEADER, SceneHeader, cull_spheres)                             \
    INTEGERS(FLAT_HEADER, SceneHeader, sky_texture)                              \
    INTEGERS(FLAT_HEADER, SceneHeader, counts[0])                                \
    INTEGERS(FLAT_HEADER, SceneHeader, counts[TYPE_QUARTETS - 1])                \
    INTEGERS(FLAT_HEADER, SceneHeader, bvh_counts[0])                            \
    INTEGERS(FLAT_HEADER, SceneHeader, bvh_counts[TYPE_QUARTETS - 1])            \
    REALS(FLAT_FIRST_SHAPE + TYPE_SUPERELLIPSOIDS, Superellipsoid, rows[2])      \
    REALS(FLAT_FIRST_SHAPE + TYPE_SUPERELLIPSOIDS, Superellipsoid, extent)       \
    REALS(FLAT_FIRST_SHAPE + TYPE_OVALS, Oval, inverses[2])                      \
    REALS(FLAT_FIRST_SHAPE + TYPE_OVALS, Oval, sizes)                            \
    REALS(FLAT_TRIANGLE_NORMALS, TriangleNormals, a)                             \
    REALS(FLAT_TRIANGLE_NORMALS, TriangleNormals, b)                             \
    REALS(FLAT_TRIANGLE_NORMALS, TriangleNormals, c)                             \
    REALS(FLAT_TRIANGLE_UVS, TriangleUvs, a_b)                                   \
    REALS(FLAT_TRIANGLE_UVS, TriangleUvs, c_density)                             \
    INTEGERS(FLAT_TRIANGLE_NEIGHBORS, TriangleNeighbors, ids_sides)              \
    REALS(FLAT_NODES, BvhNode, planes[0])                                        \
    REALS(FLAT_NODES, BvhNode, planes[1])                                        \
    REALS(FLAT_NODES, BvhNode, planes[2])                                        \
    REALS(FLAT_NODES, BvhNode, planes[3])                                        \
    REALS(FLAT_NODES, BvhNode, planes[4])                                        \
    REALS(FLAT_NODES, BvhNode, planes[5])                                        \
    INTEGERS(FLAT_NODES, BvhNode, child_index[0])                                \
    INTEGERS(FLAT_NODES, BvhNode, child_type[0])                                 \
    REALS(FLAT_TRIANGLE_BLOCKS, TriangleBlock, rows[0])                          \
    REALS(FLAT_TRIANGLE_BLOCKS, TriangleBlock, rows[BLOCK_ROWS - 1])             \
    REALS(FLAT_SPHERE_BLOCKS, SphereBlock, rows[0])                              \
    REALS(FLAT_SPHERE_BLOCKS, SphereBlock, rows[SPHERE_ROWS - 1])                \
    INTEGERS(FLAT_SPHERE_BLOCKS, SphereBlock, ids[0])                            \
    INTEGERS(FLAT_SPHERE_BLOCKS, SphereBlock, indices[0])                        \
    INTEGERS(FLAT_BLOCK_TRIANGLES, BlockTriangles, triangles)                    \
    REALS(FLAT_CULL_SPHERES, CullSphere, center_power)                           \
    INTEGERS(FLAT_OBJECTS, ObjectEntry, type_index_material)                     \
    REALS(FLAT_MATERIALS, FlatMaterial, color)                                   \
    REALS(FLAT_MATERIALS, FlatMaterial, diffuse)                                 \
    REALS(FLAT_MATERIALS, FlatMaterial, other_color)                             \
    REALS(FLAT_MATERIALS, FlatMaterial, grid)                                    \
    REALS(FLAT_MATERIALS, FlatMaterial, reflection_transmission_ior)             \
    REALS(FLAT_MATERIALS, FlatMaterial, reflection_tint)                         \
    REALS(FLAT_MATERIALS, FlatMaterial, specular_tint)                           \
    REALS(FLAT_MATERIALS, FlatMaterial, transmission_tint)                       \
    REALS(FLAT_MATERIALS, FlatMaterial, emission)                                \
    REALS(FLAT_MATERIALS, FlatMaterial, absorption)                              \
    REALS(FLAT_MATERIALS, FlatMaterial, conductor_real)                          \
    REALS(FLAT_MATERIALS, FlatMaterial, conductor_imaginary_squared)             \
    REALS(FLAT_MATERIALS, FlatMaterial, normal_u)                                \
    REALS(FLAT_MATERIALS, FlatMaterial, normal_v)                                \
    INTEGERS(FLAT_MATERIALS, FlatMaterial, optical_depth)                        \
    INTEGERS(FLAT_MATERIALS, FlatMaterial, optical_depth_green)                  \
    INTEGERS(FLAT_MATERIALS, FlatMaterial, optical_depth_blue)                   \
    INTEGERS(FLAT_MATERIALS, FlatMaterial, texture)                              \
    INTEGERS(FLAT_MATERIALS, FlatMaterial, cutout)                               \
    INTEGERS(FLAT_MATERIALS, FlatMaterial, normal_map)                           \
    REALS(FLAT_LIGHTS, FlatLight, color)                                         \
    REALS(FLAT_LIGHTS, FlatLight, position)                                      \
    REALS(FLAT_LIGHTS, FlatLight, direction)                                     \
    REALS(FLAT_LIGHTS, FlatLight, cone)                                          \
    REALS(FLAT_LIGHTS, FlatLight, fading)                                        \
    REALS(FLAT_LIGHTS, FlatLight, across_u)                                      \
    REALS(FLAT_LIGHTS, FlatLight, across_v)                                      \
    INTEGERS(FLAT_LIGHTS, FlatLight, type)                                       \
    REALS(FLAT_SKY_CELLS, FlatSkyCell, range)                                    \
    INTEGERS(FLAT_TEXTURE_LEVELS, TextureLevel, range)                           \
    INTEGERS(FLAT_TEXELS, Texel, color)                                          \
    REALS(FLAT_SHARED_MESHES, SharedMesh, extent)                                \
    INTEGERS(FLAT_SHARED_MESHES, SharedMesh, root_entry)                         \
    INTEGERS(FLAT_INSTANCE_IDS, InstanceIds, ids)
// clang-format on

typedef struct {
    size_t type;
    const char *structure, *name;
    size_t host_offset, host_size; // in the host's struct, which is the double kernels'
    bool integers;
} Member;

#define REALS_ENTRY(type, Type, member)                                                                      \
    {type, #Type, #member, offsetof(Type, member), sizeof(((Type *)0)->member), false},
#define INTEGERS_ENTRY(type, Type, member)                                                                   \
    {type, #Type, #member, offsetof(Type, member), sizeof(((Type *)0)->member), true},
#define SHAPE_ENTRY(feature, Type, name, names) INTEGERS_ENTRY(FLAT_FIRST_SHAPE + TYPE_##feature, Type, id)
static const Member members[] = {MEMBER_LIST(REALS_ENTRY, INTEGERS_ENTRY) PRIMITIVE_LIST(SHAPE_ENTRY)};
enum { MEMBER_COUNT = COUNT_OF(members) };

// One object of every shape and a texture, so that the compiled scene has every struct's layout.
static const char scene_text[] = "camera: {position: [0, 0, -5], look_at: [0, 0, 0], fov: 40}\n"
                                 "lights: [{point: {position: [1, 2, 3]}}]\n"
                                 "objects:\n"
                                 "  - sphere: {center: [0, 0, 0], radius: 1}\n"
                                 "  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n"
                                 "  - disc: {center: [0, 0, 0], normal: [0, 1, 0], radius: 1}\n"
                                 "  - box: {min: [0, 0, 0], max: [1, 1, 1]}\n"
                                 "  - cylinder: {from: [0, 0, 0], to: [0, 1, 0], radius: 1}\n"
                                 "  - cone: {from: [0, 0, 0], to: [0, 1, 0], radius: [1, 0]}\n"
                                 "  - paraboloid: {apex: [0, 0, 0], axis: [0, 1, 0], focal_length: 1}\n"
                                 "  - torus: {center: [0, 0, 0], axis: [0, 1, 0], major: 2, minor: 1}\n"
                                 "  - superellipsoid: {center: [0, 0, 0], radii: [1, 2, 3], exponent: 4}\n"
                                 "  - sphere: {center: [0, 0, 0], radius: 1, transform: {scale: [1, 2, 1]}}\n"
                                 "  - triangle: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], normals: [[0, "
                                 "0, 1], [0, 0, 1], [0, 0, 1]]}\n"
                                 "  - mesh: {file: tests/textures/quad.obj, material: {image: "
                                 "scenes/images/globe.png}}\n";

static const char instance_text[] = "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\n"
                                    "background: {horizon: 1, zenith: 1, light: true}\n"
                                    "define: {quad: {objects: [{mesh: {file: tests/textures/quad.obj}}]}}\n"
                                    "objects: [{instance: {of: quad}}]\n";

static void layouts_of_scene(FlatLayout layouts[FLAT_COUNT], const char *text, bool is_double, bool certifies)
{
    OwnedScene scene = scene_of_text("layout.yaml", text);
    const CompileSettings settings = {.width = 1,
                                      .height = 1,
                                      .sample_count = 1,
                                      .precision = is_double ? PRECISION_DOUBLE : PRECISION_SINGLE,
                                      .certifies = certifies,
                                      .instances = INSTANCES_SHARED,
                                      .lanes = BVH_WIDTH_MIN, // with blocks of triangles
                                      .bvh = BVH_ON,
                                      .shift_to_eye = true};
    OwnedCompiledScene compiled = scene_compiled(&scene, &settings);
    for (size_t type = 0; type < FLAT_COUNT; type++)
        if (compiled.arrays[type].count > 0) layouts[type] = compiled.arrays[type].layout;
}

// `certified` has the triangles' neighbors and copies instances.
static void layouts_of_host(FlatLayout layouts[FLAT_COUNT], bool is_double)
{
    memset(layouts, 0, FLAT_COUNT * sizeof *layouts);
    layouts_of_scene(layouts, instance_text, is_double, false);
    layouts_of_scene(layouts, scene_text, is_double, true);
    for (size_t type = 0; type < FLAT_COUNT; type++)
        assert_true(layouts[type].size > 0);
}

// Writes kernels that follow lanes.h and types.h and return the device's layout of each member, and its value
// in the second struct of an array.
static void kernels_write(Text *text)
{
    text_appendf(text, "#include \"lanes.h\"\n#include \"types.h\"\n"
                       "kernel void layout(global uint *sizes, global uint *offsets, uint unused)\n{\n");
    for (size_t i = 0; i < MEMBER_COUNT; i++)
        text_appendf(text,
                     "    { %s s; sizes[%zu] = sizeof(s);\n"
                     "      offsets[%zu] = (uint)((private char *)&s.%s - (private char *)&s); }\n",
                     members[i].structure, i, i, members[i].name);
    text_appendf(text, "}\n"
                       "kernel void member(global const uint4 *items, global void *values, uint which)\n{\n"
                       "    switch (which) {\n");
    for (size_t i = 0; i < MEMBER_COUNT; i++)
        text_appendf(
            text, "    case %zu: vstore4(((global const %s *)items)[1].%s, 0, (global %s *)values); break;\n",
            i, members[i].structure, members[i].name, members[i].integers ? "uint" : "scalar");
    text_appendf(text, "    }\n}\n");
}

static cl_program program_make(bool is_double)
{
    OwnedText text = {0};
    kernels_write(&text);
    cl_program program = probe_program(text_c(&text), 1, is_double ? PRECISION_DOUBLE : PRECISION_SINGLE,
                                       true, 0, "-cl-std=CL1.2");
    return program;
}

// Runs a kernel of two buffers and a number. Both buffers are written back.
static void kernel_run(cl_program program, const char *name, void *first, size_t first_size, void *second,
                       size_t second_size, uint32_t number)
{
    cl_kernel kernel = probe_kernel(program, name);
    cl_mem buffers[] = {buffer_create(&probe_compute, first_size, first, CL_MEM_READ_WRITE),
                        buffer_create(&probe_compute, second_size, second, CL_MEM_READ_WRITE)};
    kernel_argument(&probe_compute, kernel, 0, sizeof(cl_mem), &buffers[0]);
    kernel_argument(&probe_compute, kernel, 1, sizeof(cl_mem), &buffers[1]);
    kernel_argument(&probe_compute, kernel, 2, sizeof number, &number);
    const size_t one = 1;
    kernel_launch(&probe_compute, kernel, 1, NULL, &one, &one);
    buffer_read(&probe_compute, buffers[0], first_size, first);
    buffer_read(&probe_compute, buffers[1], second_size, second);
    buffer_release(buffers[0]);
    buffer_release(buffers[1]);
    clReleaseKernel(kernel);
}

// Returns where the rule of types.h puts a member. Members of scalar4 come first and have as many bytes as
// the kernel's four numbers.
static size_t member_offset(const Member *member, const FlatLayout *layout, bool is_double)
{
    if (is_double) return member->host_offset;
    size_t reals_size = layout->scalar4_count * sizeof(scalar4);
    if (!member->integers) return member->host_offset / 2;
    return member->host_offset - reals_size / 2;
}

static void layout_check(void **state)
{
    const bool is_double = *(const bool *)*state;
    if (is_double && !probe_compute.device->fp64) skip();
    FlatLayout layouts[FLAT_COUNT];
    layouts_of_host(layouts, is_double);
    cl_program program = program_make(is_double);
    uint32_t sizes[MEMBER_COUNT] = {0}, offsets[MEMBER_COUNT] = {0};
    kernel_run(program, "layout", sizes, sizeof sizes, offsets, sizeof offsets, 0);
    for (size_t i = 0; i < MEMBER_COUNT; i++) {
        const FlatArray one = {NULL, 1, layouts[members[i].type]};
        size_t size = flat_array_size(&one, is_double),
               offset = member_offset(&members[i], &one.layout, is_double);
        if (sizes[i] != size)
            fail_msg("sizeof(%s): %u on the device, %zu here", members[i].structure, sizes[i], size);
        if (offsets[i] != offset)
            fail_msg("%s.%s: at %u on the device, at %zu here", members[i].structure, members[i].name,
                     offsets[i], offset);
    }
    clReleaseProgram(program);
}

TEST_CASE(layout_in_float, layout_check, &(bool){false})
TEST_CASE(layout_in_double, layout_check, &(bool){true})

// Returns a number that differs from that of any other place and that float holds exactly.
static double real_at(size_t member, size_t component)
{
    return (double)(8 * member + component) + 0.25;
}

static uint32_t integer_at(size_t member, size_t component)
{
    return (uint32_t)(0x80000000u + 8 * member + component);
}

// Returns two structs with every member of the type set in the second.
static FlatArray array_fill(size_t type, const FlatLayout *layout)
{
    FlatArray array = {aligned_alloc(64, (2 * layout->size + 63) / 64 * 64), 2, *layout};
    assert_non_null(array.items);
    memset(array.items, 0, 2 * layout->size);
    for (size_t i = 0; i < MEMBER_COUNT; i++) {
        if (members[i].type != type) continue;
        // reals that the host keeps as floats: those of blocks
        const bool is_narrow = !members[i].integers && layout->scalar4_count == 0;
        char *place = (char *)array.items + layout->size + members[i].host_offset / (is_narrow ? 2 : 1);
        for (size_t k = 0; k < 4; k++) {
            if (members[i].integers)
                ((uint32_t *)(void *)place)[k] = integer_at(i, k);
            else if (is_narrow)
                ((float *)(void *)place)[k] = (float)real_at(i, k);
            else
                ((double *)(void *)place)[k] = real_at(i, k);
        }
    }
    return array;
}

static void member_check(cl_program program, size_t index, void *bytes, size_t size, bool is_double)
{
    union {
        double wide[4];
        float narrow[4];
        uint32_t integers[4];
    } values = {{0}};
    kernel_run(program, "member", bytes, size, &values, sizeof values, (uint32_t)index);
    for (size_t k = 0; k < 4; k++) {
        bool equal = members[index].integers ? values.integers[k] == integer_at(index, k)
                     : is_double             ? values.wide[k] == real_at(index, k)
                                             : (double)values.narrow[k] == real_at(index, k);
        if (!equal)
            fail_msg("%s.%s, component %zu: what the host uploaded is not what the device reads",
                     members[index].structure, members[index].name, k);
    }
}

static void values_check(void **state)
{
    const bool is_double = *(const bool *)*state;
    if (is_double && !probe_compute.device->fp64) skip();
    FlatLayout layouts[FLAT_COUNT];
    layouts_of_host(layouts, is_double);
    cl_program program = program_make(is_double);
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        FlatArray array = array_fill(type, &layouts[type]);
        size_t size = flat_array_size(&array, is_double);
        OWNED char *bytes = memory_allocate(size, 1);
        flat_array_write(&array, is_double, bytes);
        for (size_t i = 0; i < MEMBER_COUNT; i++)
            if (members[i].type == type) member_check(program, i, bytes, size, is_double);
        free(array.items);
    }
    clReleaseProgram(program);
}

TEST_CASE(values_in_float, values_check, &(bool){false})
TEST_CASE(values_in_double, values_check, &(bool){true})

// The list above has every member, since they fill their struct. In a shape's struct the id is last.
TEST(list_is_complete)
{
    FlatLayout layouts[FLAT_COUNT];
    layouts_of_host(layouts, true);
    // between the ends
    size_t filled[FLAT_COUNT] = {[FLAT_HEADER] = 2 * (TYPE_QUARTETS - 2) * sizeof(uint4),
                                 [FLAT_TRIANGLE_BLOCKS] = (BLOCK_ROWS - 2) * sizeof(scalar4),
                                 [FLAT_SPHERE_BLOCKS] = (SPHERE_ROWS - 2) * sizeof(scalar4)};
    for (size_t i = 0; i < MEMBER_COUNT; i++) {
        size_t *bytes = &filled[members[i].type];
        bool is_shape = members[i].type - FLAT_FIRST_SHAPE < TYPE_COUNT;
        *bytes = is_shape ? members[i].host_offset + members[i].host_size : *bytes + members[i].host_size;
    }
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        size_t padding = layouts[type].size - filled[type];
        if (filled[type] > layouts[type].size || padding >= sizeof(scalar4))
            fail_msg("flat type %zu: members of %zu bytes listed, the struct has %zu", type, filled[type],
                     layouts[type].size);
    }
}

// Writes enough structs of each layout for several threads. They must equal what one thread writes, part by
// part.
static void threads_write_what_one_does(void **state)
{
    const bool is_double = *(const bool *)*state;
    enum { COUNT = 2 * FLAT_RANGE_MIN + 1, PART = 331 };
    _Static_assert(COUNT % PART == 0 && (int)PART < (int)FLAT_RANGE_MIN, "equal parts, each for one thread");
    FlatLayout layouts[FLAT_COUNT];
    layouts_of_host(layouts, true);
    for (size_t type = 0; type < FLAT_COUNT; type++) {
        const FlatLayout *layout = &layouts[type];
        const size_t words = COUNT * layout->size / sizeof(uint32_t);
        FlatArray array = {memory_allocate_large(COUNT, layout->size), COUNT, *layout};
        for (size_t i = 0; i < words; i++) // doubles that are floats, about 1
            ((uint32_t *)array.items)[i] = i % 2 ? 0x3ff00000u + (uint32_t)(i & 0xffff) : 0;
        OWNED char *written = memory_allocate(flat_array_size(&array, is_double), 1);
        flat_array_write(&array, is_double, written);
        for (size_t i = 0; i < COUNT; i += PART) {
            const FlatArray part = {flat_array_at(&array, i), PART, *layout};
            const size_t size = flat_array_size(&part, is_double);
            OWNED char *bytes = memory_allocate(size, 1);
            flat_array_write(&part, is_double, bytes);
            assert_memory_equal(bytes, written + i / PART * size, size);
        }
        free(array.items);
    }
}

TEST_CASE(narrowing_is_independent_of_threads, threads_write_what_one_does, &(bool){false})
TEST_CASE(copying_is_independent_of_threads, threads_write_what_one_does, &(bool){true})

TEST_MAIN(probe_open, probe_close)
