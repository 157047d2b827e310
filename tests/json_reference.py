"""Makes docs/glint-json.5 of what the commands print and of the meanings below.

A meaning belongs to a member's path, or to the end of it; the longest that fits counts. "type; words", where the words may
be missing. Types: text, hash, boolean, count (an integer, 0 or more), integer, number, object, figure, or several.
"""
import re

INTRODUCTION = """\
.\\" Written by tests/test_json.py --write.
.TH GLINT\\-JSON 5 "" "glint" "File Formats"
.ad l
.SH NAME
glint\\-json \\- reports of glint as JSON
.SH DESCRIPTION
Each command of glint prints one JSON object with
.BR \\-\\-json ,
and
.B glint render
with
.BR \\-\\-timing=json .
.PP
The member
.B schema
is the version of a command's members. It rises when a member is renamed, removed or changes its meaning, not when one is added.
.PP
Below,
.B a[]
is an element of the array
.BR a ,
and
.B a.{b,c}
stands for
.BR a.b " and " a.c .
A count is an integer, 0 or more, and a hash a text of 16 hexadecimal digits.
Names end in the unit: _ms for milliseconds, _bytes, _mhz.
A number that is not finite is null, such as the PSNR of equal images.
A figure may be unavailable; an object with the members
.BR status ,
which is "unavailable", and
.B reason
then replaces it.
.PP
A member is always present unless its entry states when.
In every report
.B glint
is the program's version, and
.B device
has the name, platform, driver, passports and other members of
.BR "glint devices" .
.BR fault " and " clock_fault
appear where the device's clock is not trusted, and state the reason.
"""
TAIL = """\
.SH SEE ALSO
.BR glint (1),
docs/glint.schema.json for the same as JSON Schema (2020-12), docs/accuracy.md for the figures of glint accuracy, render \\-\\-max\\-error and certify, docs/verify.md for the cases, docs/numerics.md for passports
"""
NOTES = {
    "glint render --timing=json": "glint-mpi render adds `by_rank[]`, with the members `host`, `name`, `driver`, `lanes`, `share`, `bands`, "
                                  "`busy_ms` and `idle_ms` for each rank but the first. With several scenes or "
                                  "frames, each image that is rendered has one line with its object.",
    "glint check": "",
    "glint devices": "`passports[]` has the passports that are known, in other reports those that were needed. `refused[]` has each "
                     "`precision` that a passport refuses, and the `reason`. Both may be empty.",
    "glint diff": "Nothing is printed if the images cannot be compared (exit status 1).",
    "glint bench": "A row that cannot be measured has only the members up to `size`, `status` and `reason`.",
    "glint bench --against": "Members that are not listed are those of glint bench; `frame_ms` and `frame_samples_ms` are this program's.",
    "glint accuracy": "A row has `frame_ms`, `kernel_ms`, `clock`, `rays` and `mrays_per_s` of glint bench. A reference's row ends with `saved`, "
                      "an unavailable one with `reason`. The HTML report embeds the same object.",
    "glint certify": "A precision that the device or scene does not support has only `precision`, `status` and `reason`; one that "
                     "--precision names is an error.",
    "glint golden check": "A scene that is the same has no rectangle.",
    "glint verify": "A case in which the driver crashed has `crash`, a text that names the call and the kernel, and only `name`, `title`, "
                    "`passed` and `seconds` otherwise.",
}
# A path that begins so has no row, because the introduction, a note or a row names the section that has it.
ELSEWHERE = {
    "glint render --timing=json": ("glint", "by_device[].passports"),
    "glint check": ("glint",),
    "glint devices": ("glint",),
    "glint diff": ("glint",),
    "glint bench": ("glint", *(f"device.{name}" for name in ("name", "board", "pci", "uuid", "platform", "driver", "type", "units", "clock_mhz", "passports")),
                    "runs[].launches[].", "runs[].passports[]."),
    "glint bench --against": ("glint", "date", "host", "build", "device", *(f"runs[].{name}" for name in (
        "scene", "variant", "precision", "lanes", "bvh", "size", "samples", "bounces", "comparison", "frame_ms", "frame_samples_ms"))),
    "glint accuracy": ("glint", "device", *(f"scenes[].variants[].{name}" for name in (
        "frame_ms", "kernel_ms", "clock", "rays", "mrays_per_s"))),
    "glint certify": ("glint", "device"),
    "glint golden check": ("glint", "device"),
    "glint verify": ("glint", "device"),
}
MEANINGS = {
    "schema": "integer",
    "glint": "text",
    "device": "object",
    "device.{name,platform,platform_version,driver,type}": "text",
    "device.{units,clock_mhz}": "count",
    "passports[]": "object; what the arithmetic does at a precision, once that is measured",
    "passports[].precision": "text; `single` (also of the first pass of `certified`), `strict` or `double`",
    "passports[].lanes": "integer; of the vectors",
    "passports[].thorough": "boolean; false: a sample of mantissas was divided",
    "passports[].uses_fma": "boolean; false: kernels compute fma from products and sums",
    "passports[].fma_cost": "number or null; time of an fma over that of a product and a sum",
    "passports[].{division,square_root}": "object; results as the device rounds them",
    "largest_ulp": "number or null; the largest error; 0.5 if all are correctly rounded; `null`: not finite",
    "passports[].{division,square_root}.{count,wrong}": "count; of results, and of those not correctly rounded",
    "exhaustive": "boolean; all mantissas of a binade are among them",
    "passports[].build_ms": "number; of the kernel",
    "passports[].probe_ms": "number; of the measurement",
    "passports[].properties[]": "object",
    "passports[].properties[].name": "text",
    "passports[].properties[].finding": "text; `sound`, `unusual` (glint allows for it) or `broken` (precisions are refused)",
    "passports[].properties[].value": "text; what was found",
    "perturb": "object; only with `--perturb`",
    "perturb.{seed,scale}": "integer",
    "scene": "text; path",
    "size": "integer; width, height",
    "samples": "integer; per pixel",
    "frame": "number; only with `--frames`",
    "precision": "text; `single`, `strict`, `double` or `certified`",
    "{rerendered,uncertified}_samples": "count; at `certified`: re-rendered in double, and uncertified",
    "lanes": "integer; 1, 4, 8 or 16",
    "bvh": "text; `auto`, `on` or `off`",
    "kernel_hash": "hash; of the kernel's text",
    "parse_ms": "number; reading the scene",
    "pixels": "count; of the sample",
    "reference_uncertain": "count; of these, within 2^-80 of the distance of another answer: not counted as right or wrong",
    "reference_ms": "number; computing it",
    "scenes[].same": "boolean; all hashes are those of the line",
    "scenes[].verdict": "text; `same`, `different`, `another scene` (with another hash), `no line` or `not rendered`",
    "scenes[].first": "text or null; the layer that differs first",
    "scenes[].tiles": "count; of 96, whose color differs",
    "scenes[].{left,top,right,bottom}": "count; pixels of the rectangle that has these tiles; `right` and `bottom` are beyond it",
    "scenes[].crop": "text or null; the file that shows the rectangle",
    "precisions[].compared": "count; pixels",
    "precisions[].wrong": "object; pixels, each in the first way that is wrong",
    "precisions[].wrong.{object,shadow,path}": "count",
    "precisions[].wrong.color": "count; a channel is off by more than `color.bound` times the largest channel, or 1 if that is more",
    "precisions[].wrong.margin": "number; how far they are from another answer, the most, in parts of the distance",
    "precisions[].color": "object; errors of a channel",
    "precisions[].color.pixels": "count; without textures on their way",
    "precisions[].color.bound": "number; that `certified` keeps",
    "precisions[].color.{max_right,max_wrong}": "number; where nothing is wrong, and where something is",
    "precisions[].color.{x,y}": "count; the pixel of the larger",
    "precisions[].wrong_certified": "count; at `certified`: wrong pixels that are not uncertified, contradicted ones among them",
    "precisions[].claim": "text; `kept` or `broken`; at `certified`",
    "precisions[].unconfirmed": "count; at `certified`: pixels that it decides and the reference does not",
    "precisions[].contradicted": "count; of these, whose answer differs from the reference's",
    "precisions[].uncertified": "object; at `certified`",
    "precisions[].uncertified.pixels": "count; of the image",
    "precisions[].uncertified.examined": "count; of these",
    "precisions[].uncertified.witnessed": "count; errors of 2^-50 change their answer",
    "precisions[].uncertified.close": "count; not so, but within 2^-49 of the distance of another answer",
    "pilot": "object; only with `--max-error`",
    "pilot.limit": "number; the budget",
    "pilot.metric": "text; `rmse`, `max` or `flip`",
    "pilot.confidence": "number; that all bounds hold",
    "pilot.pixels": "count; rendered at each precision",
    "pilot.color_max": "number or null; the largest channel that lights and materials allow",
    "pilot.{total_ms,build_ms}": "number; building or loading kernels is part of it",
    "pilot.candidates[]": "object; one of each precision",
    "pilot.candidates[].status": "text; `measured`, `untried` (a cheaper one keeps the budget, or no sample can show that it does) or `unavailable`",
    "pilot.candidates[].error": "number; of the pilot's pixels",
    "pilot.candidates[].bound": "number or null; of the image's error; of `max`: of the share of pixels beyond the budget",
    "pilot.candidates[].keeps": "boolean; the bound is within the budget; of `max`: the pilot's pixels are",
    "pilot.candidates[].pixel_ns": "number; time of a pixel",
    "flatten_ms": "number; flattening it to arrays",
    "by_device[]": "object; what each device did",
    "by_device[].{name,platform,driver}": "text; from OpenCL",
    "{launches[],read_backs[]}.clock": "text; of the time that counts: `event` (the device's) or `host`",
    "by_device[].build_out_of_line": "boolean; the driver failed to build a kernel with its functions inlined",
    "by_device[].double_by": "text or null; at `certified` another device that re-renders pixels in double",
    "by_device[].share": "number; of the rows, 0 to 1",
    "by_device[].bands": "count; that it rendered",
    "by_device[].busy_ms": "number; rendering bands",
    "by_device[].idle_ms": "number; the rest of `render_ms`",
    "render_ms": "number; all bands, builds included",
    "upload_ms": "number; copying the arrays to the device",
    "encode_ms": "number; encoding and writing the files",
    "bvh_ms": "number or null; building the BVH; null without one",
    "build_ms": "number; building or loading the kernels",
    "build_from_cache": "boolean; all were cached",
    "{launches[],read_backs[]}": "object; in order",
    "{launches[],read_backs[]}.name": "text; kernel, or `read-back`",
    "{launches[],read_backs[]}.event_ms": "number or null or figure; the device's clock, where trusted",
    "{launches[],read_backs[]}.host_ms": "number; the host's clock",
    "{launches[],read_backs[]}.{queued_ms,submitted_ms,start_ms,end_ms}": "number or null; by the device's clock, where trusted and reported, since its first command was queued",
    "{launches[],read_backs[]}.global": "count; work-items in each dimension",
    "{launches[],read_backs[]}.local": "count; work-items of a group in each dimension",
    "build_options": "text; that the kernels were compiled with",
    "{launches[],read_backs[]}.fault": "text; why the device's clock is not trusted",
    # check
    "valid": "boolean; if not, only the messages follow",
    "objects": "count; a mesh is one",
    "shapes": "object; objects of each",
    "shapes.*": "count",
    "mesh_triangles": "count; of all meshes",
    "unbounded": "count; objects outside `bounds`",
    "{lights,materials,pixels}": "count",
    "frames": "count; that the scene names; 0 if it does not",
    "fps": "number; frames per second that the scene names; 0 if it does not",
    "bounds": "object or null; of all bounded objects; null if there are none",
    "bounds.{min,max}": "number; x, y, z",
    "features": "text; the kernel's (kernels/features.h)",
    "{warnings[],errors[]}": "object; in order",
    "{warnings[],errors[]}.file": "text or null",
    "{warnings[],errors[]}.{line,column}": "count; from 1, in characters; 0 if unknown",
    "{warnings[],errors[]}.text": "text",
    # devices
    "{platforms,platforms_without_device}": "count",
    "devices[]": "object",
    "devices[].index": "count; for `--device`",
    "devices[].twin": "count; earlier devices of its platform and name",
    "devices[].default": "boolean; used without `--device`",
    "devices[].usable": "boolean; kernels can be built and run",
    "devices[].unusable_because": "text or null",
    "devices[].{name,vendor,platform,platform_version,version,driver}": "text; from OpenCL",
    "board": "text or null; of AMD's devices",
    "pci": "text or null; domain:bus:device.function, where the driver tells it",
    "uuid": "text or null; 32 hexadecimal digits, where the driver tells it",
    "devices[].profile": "text; `full` or `embedded`",
    "devices[].type": "text; `cpu`, `gpu`, `accelerator` or `other`",
    "devices[].units": "count; compute units",
    "devices[].clock_mhz": "count; the driver's maximum; 0 if unknown",
    "devices[].lanes": "integer; the default",
    "devices[].{native_float_width,native_double_width}": "count; of vectors",
    "devices[].{fp64,denormals,fma}": "boolean; double precision, subnormal numbers, fma in hardware",
    "devices[].{correctly_rounded_divide_sqrt,compiler}": "boolean",
    "devices[].address_bits": "count; of 32 the sizes below are less than 4 GiB; 0 if unknown",
    "devices[].{memory_bytes,largest_buffer_bytes,local_memory_bytes}": "count",
    "devices[].largest_work_group": "count; work-items",
    "devices[].timer_resolution_seconds": "number; of events",
    "devices[].refused[]": "object; a precision that the passports refuse",
    "devices[].refused[].{precision,reason}": "text",
    # diff
    "reference": "text; path",
    "image": "text; path",
    "channels": "integer; 3 for colors, 1 for gray and distances",
    "kind": "text; `display` (PNG, JPEG, PPM), `linear` (EXR, NPY) or `data` (NPY of other than 3 channels)",
    "equal": "boolean; all bits agree",
    "differing_values": "count",
    "nonfinite_pixels": "object",
    "nonfinite_pixels.{reference,image}": "count; pixels with a NaN or infinity",
    "unmatched_values": "count; pairs in which one value is not finite and the other differs; they exceed every limit",
    "max_ulp": "number or null; the largest difference in units in the last place of the reference, as a float if either file holds floats; "
               "not for `display` and integers; null: a value is unmatched",
    "limits": "object; only with limits",
    "limits.*": "object; only where that limit is given",
    "limits.*.limit": "number; what is allowed",
    "limits.*.value": "number or null; what was found",
    "limits.*.met": "boolean",
    "met": "boolean; all limits are; then the exit status is 0, else 3; only with limits",
    "linear": "object; differences in linear light, or of data as they are, where both are finite",
    "linear.values": "count; compared",
    "linear.{max_abs,rmse,p99_9,rel_mse}": "number; relMSE divides each square by that of the reference plus 0.01",
    "bias": "number; signed mean",
    "psnr": "number or null; decibels",
    "srgb8": "object; 8-bit sRGB; not for gray linear images and data",
    "srgb8.{off_by_1,off_by_2_or_more}": "count; values",
    "flip": "object; only with `srgb8`",
    "flip.{mean,max}": "number; perceived difference, 0 to 1",
    "flip.pixels_per_degree": "integer",
    "worst": "object; the largest difference",
    "worst.{x,y}": "count; from the top left",
    "worst.{reference,image}": "number or null; values per channel",
    "heatmap": "object; only with `--heatmap`",
    "heatmap.file": "text; path",
    "heatmap.{white,black}": "number; the differences shown white and black",
    # bench
    "clock": "text; `event` (the device's) or `host`",
    "clock_fault": "text; why the device's clock is not trusted",
    "runs[]": "object; a row",
    "status": "text; `unavailable`",
    "reason": "text; why not measured",
    "frame_ms": "object; first command to pixels on the host",
    "kernel_ms": "object; sum of the launches, by `clock`",
    "processor_ms": "number; of all processors together, that this process used for a frame: the median",
    "{frame_ms,kernel_ms,against_frame_ms}.{min,median,max}": "number",
    "{frame_ms,kernel_ms,against_frame_ms}.quartile_range": "number; upper less lower quartile",
    "{frame_ms,kernel_ms,against_frame_ms}.runs": "count",
    "runs[].build_ms": "object; each with the first launch",
    "runs[].build_ms.{cold,cached}": "figure",
    "rays": "object; per image",
    "rays.{camera,camera_hits,reflected,refracted,shadow}": "count",
    "mrays_per_s": "number; rays of all kinds over the median of `kernel_ms`",
    "traverses_bvh": "boolean",
    "runs[].drift": "object; the last fifth of the runs compared with the first, by processor time on a CPU, else by kernel time",
    "runs[].drift.verdict": "text; `same` within 5%, `slower` (a device that is throttled or shared), `faster` or `undecided`",
    "runs[].drift.ratio": "number; estimated",
    "runs[].drift.{low,high}": "number or null; of its confidence interval; null: too few runs",
    "runs[].energy": "figure; of frames over a second or more",
    "runs[].energy.source": "text; `NVML`, of the board, or `RAPL`, of the processors without their memory",
    "runs[].energy.frame_mj": "number; millijoules per frame",
    "runs[].energy.watts": "number; the mean",
    "date": "text; UTC, ISO 8601",
    "host": "object",
    "host.{name,system,release,machine}": "text; from uname",
    "host.processors": "count; online",
    "build": "object; of glint",
    "build.commit": "text; `unknown` outside of clones and archives of git",
    "build.compiler": "text",
    "calibration": "object; of a fixed workload on the host, before each round",
    "calibration.rounds": "count; iterations of that workload",
    "calibration.{samples_ms,processor_samples_ms}": "number; its wall time, and that of all processors together",
    "runs[].variant": "text; the options of `--variant`; only with that",
    "runs[].to_first": "figure; frame time over that of the first variant's row, of the rounds that both ran; only with `--variant`, from its second on",
    "runs[].to_first.ratio": "number; estimated",
    "runs[].passports[]": "object; of the row's build options, as `device.passports[]`; only with these in `--variant`",
    "runs[].to_first.{low,high}": "number or null; of its confidence interval; null: too few repeats",
    "scene_hash": "hash; of the contents of the scene's files; rows of reports match by it",
    "{frame_samples_ms,kernel_samples_ms,processor_samples_ms}": "number; of every run, in order",
    "comparison": "figure; frame time, new over old; only with `--compare` or `--against`",
    "comparison.processor": "object; of the processor time; only with `--compare` and a CPU device",
    "comparison.verdict": "text; `same`, `slower`, `faster` or `undecided`; of both times",
    "comparison.ratio": "number; estimated",
    "comparison.{low,high}": "number or null; of its confidence interval; null: too few repeats",
    "comparison.processor.verdict": "text; that of the processor time alone",
    "comparison.processor.ratio": "number; estimated",
    "comparison.processor.{low,high}": "number or null; of its confidence interval; null: too few repeats",
    "against": "text; the other program",
    "confidence": "number; of all intervals together",
    "against_frame_ms": "object; of the other program, as `frame_ms`",
    "against_frame_samples_ms": "number; of the other program",
    "pair_ratios": "number; of each pair of processes",
    "runs[].launches[]": "object; of the last run, as in `glint render`; only with `--launches`",
    # accuracy
    "scenes[]": "object; in order",
    "bounces": "count; limit per ray",
    "min_contribution": "number; rays of lower weight are not traced",
    "scenes[].reference": "object",
    "scenes[].reference.kind": "text; `render` or `file`",
    "scenes[].reference.device": "text; as `devices[].name`",
    "scenes[].reference.file": "text; only of a file, in place of `device` to `kernel_hash`",
    "{nonfinite,negative}": "count; pixels with such a channel",
    "saved": "text; prefix of its .npy files; only with `--save`",
    "edges": "figure; pixels at edges; unavailable for a file",
    "edges.{silhouette,path}": "count",
    "edges.shadow": "count; per light",
    "variants[]": "object; a row",
    "variants[].status": "text; `measured`, `reference` or `unavailable`",
    "crossed_out": "boolean",
    "why": "text; the reasons",
    "errors": "object",
    "errors.{object,shadow,path}": "figure; unavailable against a file",
    "errors.{object,shadow,path}.{edge,away}": "count; pixels (shadow: bits)",
    "errors.{shading,t,normal}": "figure; unavailable against a file or without common pixels",
    "errors.{shading,t,normal}.pixels": "count; compared",
    "errors.shading.{max,rmse,p99_9}": "number; linear light",
    "errors.t.{relative,ulps}": "object; ulp of the row's precision",
    "errors.t.{relative,ulps}.{max,p99_9}": "number",
    "errors.normal.{max,p99_9}": "number; radians",
    "errors.image": "object; linear light",
    "errors.image.{rmse,rel_mse,flip_mean,flip_max}": "number",
    "errors.image.srgb_psnr": "number or null; decibels",
    "errors.image.{off_by_1,off_by_more}": "count; 8-bit values",
    "variants[].worst": "object; the pixel with the largest error of each kind, away from edges if there is one",
    "variants[].worst.{object,shadow,path,shading,t,normal,image}": "object or null",
    "variants[].worst.*.{x,y}": "count; from the top left",
    "variants[].worst.*.away": "boolean; from edges",
    "variants[].worst.shadow.light": "count; index",
    "variants[].worst.*.error": "number or null; of color; relative for `t`, radians for `normal`",
    "variants[].worst.*.{reference,variant}": "number or null; id, shadow bit, path hash, distance or channels",
    "variants[].worst.*.{reference_color,variant_color}": "number or null; linear RGB",
    "pareto": "object; per kind: no other row is as good and faster",
    "pareto.*": "boolean; only where available",
    "scenes[].confidence": "number; of all intervals of its picks together",
    "picks[]": "object; the fastest row within each budget",
    "picks[].budget": "number",
    "picks[].measure": "text; `shading`, or `image` against a file",
    "picks[].variant": "count or null; index; null if none is within it",
    "picks[].error": "number or null; only with a row",
    "picks[].frame_ms": "number; median; only with a row",
    "picks[].others[]": "object; the other rows within the budget",
    "others[].variant": "count; index",
    "others[].ties": "boolean; not certainly slower",
    "others[].{ratio,low}": "number; of its time to the pick's, estimated and least",
    "others[].high": "number or null; greatest; null with too few runs",
    "picks[].text": "text; as a sentence",
    # verify
    "reference_bits": "integer; significand of the exact reference",
    "quick": "boolean; whether rays and pixels were fewer (`--quick`)",
    "precisions[]": "object",
    "tier": "text; `A`, `B`, `C` or `D`",
    "{trace_kernel,render_kernel}": "hash; zeros if not needed",
    "{passed,failed}": "count; cases",
    "seconds": "number",
    "cases[]": "object; in order",
    "cases[].{name,title}": "text",
    "cases[].passed": "boolean; the counts from `wrong` to `differing` are 0",
    "cases[].rays": "count; rays and pixels",
    "wrong": "count; hits, misses, objects, errors beyond their bound",
    "leaks": "count; misses of closed surfaces",
    "unsound": "count; not finite, behind the origin, normals not unit",
    "{off,turned}": "count; points, normals off the surface's by more than their bounds",
    "differing": "count; answers whose bits must not differ",
    "{surface_part,normal_part}": "number; the largest errors over their bounds",
    "cases[].{worst,bound}": "number or null; of the error closest to its bound",
    "unit": "text; of both, if there are any",
    "hash": "hash; of all answers' bits: equal at `strict` on every device with IEEE arithmetic",
}


def alternatives(name):
    """Returns the names that a name with braces stands for, as a.{b,c} stands for a.b and a.c."""
    if not (group := re.search(r"\{([^}]*)\}", name)):
        return [name]
    return [way for word in group[1].split(",") for way in alternatives(name[:group.start()] + word + name[group.end():])]


PATTERNS = {way: (name, *(meaning + "; ").split("; ", 1))
            for name, meaning in MEANINGS.items() for way in alternatives(name)}


def meaning_of(path):
    """Returns the rule, type and words of a member, or None if there are none."""
    parts = path.split(".")
    for start in range(len(parts)):
        end = parts[start:]
        for at in [None, *range(len(end))]:  # a name, then one part left open
            way = ".".join("*" if i == at else part for i, part in enumerate(end))
            if way in PATTERNS:
                return PATTERNS[way]
    return None


class Shape:
    """The values of reports at one place, with the count of each type and the members within."""
    def __init__(self):
        self.types, self.members, self.elements = {}, {}, None

    def add(self, value, path=""):
        """Adds the value at the path."""
        if isinstance(value, dict) and value.get("status") == "unavailable" and len(value) == 2:
            self.types["unavailable"] = {"$ref": "#/$defs/unavailable"}
        elif isinstance(value, dict):
            self.types["object"] = {"type": "object"}
            for name in self.members:  # absent here
                self.members[name][1] &= name in value
            for name, member in value.items():
                is_first = "seen" not in self.types
                shape, _ = self.members.setdefault(name, [Shape(), is_first])
                shape.add(member, f"{path}.{name}" if path else name)
            self.types["seen"] = None
        elif isinstance(value, list):
            self.types["array"] = {"type": "array"}
            holds_objects = any(isinstance(element, dict) for element in value)
            for element in value:
                self.elements = self.elements or Shape()
                self.elements.add(element, path + "[]" if holds_objects else path)
        else:
            for kind in meaning_of(path)[1].split(" or "):
                if kind != "object":  # as objects seen there are
                    self.types[kind] = SCALARS[kind]

    def schema(self):
        ways = [dict(way) for name, way in self.types.items() if name != "seen" and way]
        for way in ways:
            if way.get("type") == "object":
                way["properties"] = {name: shape.schema() for name, (shape, _) in self.members.items()}
                way["required"] = [name for name, (_, is_always) in self.members.items() if is_always]
            if way.get("type") == "array" and self.elements:
                way["items"] = self.elements.schema()
        return ways[0] if len(ways) == 1 else {"anyOf": ways}


UNAVAILABLE = {"type": "object", "properties": {"status": {"const": "unavailable"}, "reason": {"type": "string"}},
               "required": ["status", "reason"]}
SCALARS = {"null": {"type": "null"}, "boolean": {"type": "boolean"}, "text": {"type": "string"}, "number": {"type": "number"},
           "hash": {"type": "string", "pattern": "^[0-9a-f]{16}$"}, "count": {"type": "integer", "minimum": 0},
           "integer": {"type": "integer"}}
SCALARS["figure"] = {"anyOf": [SCALARS["number"], {"$ref": "#/$defs/unavailable"}]}


def schema_of(reports):
    """Returns the JSON Schema of reports of one command, which together are of every type that it prints."""
    shape = Shape()
    for report in reports:
        shape.add(report)
    return shape.schema()


def braced(words):
    return words[0] if len(words) == 1 else "{" + ",".join(words) + "}"


def merged(rows):
    """Merges rows of one type and meaning whose paths differ in one part into one row with alternatives."""
    kept = []
    for parts, kind, words in rows:
        for row in kept:
            differing = [i for i, (a, b) in enumerate(zip(row[0], parts)) if b[0] not in a]
            if len(row[0]) == len(parts) and row[1:] == (kind, words) and len(differing) <= 1 and parts[0] != ["schema"]:
                for i in differing:
                    row[0][i].extend(parts[i])
                break
        else:
            kept.append((parts, kind, words))
    return kept


def roff(text):
    """Returns the text in roff, with `words` in bold."""
    text = re.sub("[^\0-~]", lambda character: f"\\[u{ord(character[0]):04X}]", text.replace("\\", r"\e").replace("-", r"\-"))
    return re.sub("`([^`]*)`", r"\\fB\1\\fR", text)


def breakable(path):
    """Returns the path in roff, where a line may end after a comma or a point."""
    return re.sub(r"([,.])(?=.)", r"\1\:", path)


def section(heading, schema, paths):
    """Returns the entries of a command's members, in the order printed."""
    rows = []
    for path in paths:
        rule, kind, words = meaning_of(path)
        if rule == "schema":
            words = str(schema)
        if not path.startswith(ELSEWHERE[heading]) and (kind, words) != ("object", ""):  # which its members describe
            rows.append(([[part] for part in path.split(".")], kind, words.removesuffix("; ")))
    note = f"\\&{roff(NOTES[heading])}\n" if NOTES[heading] else ""
    entries = "".join(f".TP\n\\fB{breakable(roff('.'.join(map(braced, parts))))}\\fR\n\\fI{kind}\\fR{'; ' if words else ''}{roff(words)}\n"
                      for parts, kind, words in merged(rows))
    return f".SH {roff(heading)}\n{note}{entries}"
