#!/usr/bin/env python3
"""Finds the operation that an OpenCL device computes differently from another one.

    glint render scene.yaml --precision strict --capture launches
    python3 -m glint.locate launches --device "the suspect" --reference "another"

Re-runs each captured launch on both devices until a pixel differs. Then re-runs that pixel's work-group with a kernel that
records every operation, and finds the first one that has equal operands and unequal results. Writes it as a separate program.
If the difference vanishes when all operations are recorded, finds a smallest set whose recording makes it vanish.
"""
import argparse
import base64
import functools
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyopencl as cl

from . import _instrument as instrument
from ._exact import NAN, exact, number

os.environ.setdefault("POCL_WORK_GROUP_SPECIALIZATION", "0")  # as host/opencl/device.c does
TRACE_WORDS = 1 << 22


class Failure(Exception):
    """Raised to end the search with a message for the user."""


class Launch:
    """A captured launch of a kernel.

    text: the composed text. items, first, group: the work-items, their first global ids and the work-group, per dimension; group may be
    None. arguments: by index, the bytes of a buffer, a tuple with the bytes of a value, or None for no buffer. lanes: rays per work-item.
    pixel_words: the 32-bit words of a pixel's color in the film.
    """

    def __init__(self, path):
        """Reads the launch from its JSON file and the files that it names."""
        index = json.loads(path.read_text(encoding="utf-8"))
        self.kernel, self.options = index["kernel"], shlex.split(index["options"])
        self.text = (path.parent / index["text"]).read_text(encoding="utf-8")
        self.items, self.device = index["items"], index["device"]
        self.first, self.group = index.get("first") or [0] * len(self.items), index.get("group")
        self.arguments = {}
        for argument in index["arguments"]:
            if "value" in argument:
                value = (base64.b64decode(argument["value"]),)
            else:
                value = argument["buffer"] and (path.parent / argument["buffer"]).read_bytes()
            self.arguments[argument["index"]] = value
        self.lanes = int(re.search(r"(?m)^#define LANES (\d+)", self.text)[1])
        self.repairs_divide = "#define REPAIRS_DIVIDE 1" in self.text
        self.pixel_words = 6 if "#define IS_DOUBLE 1" in self.text else 3

    @functools.lru_cache(maxsize=None)
    def program(self, definitions):
        """Returns the text as parsed for a compiler that defines the macros."""
        return instrument.parse(instrument.preprocess(self.text, definitions))

    def index(self, name):
        """Returns the index of an argument of the kernel `render`."""
        names = re.findall(r"\w+(?=,|$)", re.search(r"kernel void render\(SCENE_ARGUMENTS, (.*?)\)", self.text, re.S)[1])
        return len(self.arguments) - len(names) + names.index(name)

    @property
    def band(self):
        """Returns x and y of the first pixel, the width and the height."""
        return np.frombuffer(self.arguments[self.index("band_pixels")][0], np.uint32)


class Device:
    """An open device with the programs that it has built.

    compiler: changes the text before it is built, by which tests make a faulty compiler. options: follow those of each launch.
    """

    def __init__(self, device, compiler=lambda text: text, options=()):
        self.device, self.compiler, self.options = device, compiler, list(options)
        self.context = cl.Context([device])
        self.queue = cl.CommandQueue(self.context)
        self.programs = {}
        self.name = f"{device.platform.name}, {device.name}".strip() + "".join(f" {each}" for each in options)

    def kernel(self, text, name, options):
        """Returns a kernel of the text, which is built once. Raises cl.Error if it does not build."""
        key = text, tuple(options)
        if key not in self.programs:
            self.programs[key] = cl.Program(self.context, self.compiler(text)).build([*options, *self.options, "-w"], cache_dir=False)
        return cl.Kernel(self.programs[key], name)

    def buffer(self, data):
        """Returns a buffer with the contents of an array or of bytes."""
        contents = data if isinstance(data, np.ndarray) else bytearray(data)
        return cl.Buffer(self.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=contents)

    def read(self, buffer):
        """Returns a buffer as an array of uint32."""
        data = np.empty(buffer.size // 4, np.uint32)
        cl.enqueue_copy(self.queue, data, buffer)
        return data

    def group_fit(self, kernel, group):
        """Returns the work-group reduced to what device and kernel allow, as work_group_fit in host/opencl/launch.c does."""
        group = list(group)
        most = min(kernel.get_work_group_info(cl.kernel_work_group_info.WORK_GROUP_SIZE, self.device), self.device.max_work_group_size)
        for i, limit in enumerate(self.device.max_work_item_sizes[:len(group)]):
            while group[i] > limit:
                group[i] //= 2
        while np.prod(group) > most:
            longest = max(range(len(group)), key=lambda i: (group[i], i))
            group[longest] //= 2
        return group

    def run(self, launch, text, item=None, extra=()):
        """Runs the launch with another text, for all work-items or for the work-group of one.

        extra: arguments that follow those of the launch, arrays for buffers and scalars of NumPy for values. Returns the film and the
        buffers among `extra`, as arrays of uint32.
        """
        kernel = self.kernel(text, launch.kernel, launch.options)
        buffers = {index: self.buffer(value) for index, value in launch.arguments.items() if isinstance(value, bytes)}
        for index, value in launch.arguments.items():
            kernel.set_arg(index, buffers.get(index, value[0] if value else None))
        added = [self.buffer(value) if isinstance(value, np.ndarray) else value for value in extra]
        for index, value in enumerate(added, len(launch.arguments)):
            kernel.set_arg(index, value)
        group = self.group_fit(kernel, launch.group or [1] * len(launch.items))
        first, items = list(launch.first), [-(-count // side) * side for count, side in zip(launch.items, group)]
        if item:
            first = [begin + (at - begin) // side * side for begin, at, side in zip(launch.first, item, group)]
            items = group
        cl.enqueue_nd_range_kernel(self.queue, kernel, items, group, first).wait()
        return self.read(buffers[launch.index("film")]), [self.read(value) for value in added if isinstance(value, cl.Buffer)]


class Pixel(NamedTuple):
    """A pixel of a launch."""
    x: int  # in the image
    y: int
    at: int  # index in the film
    item: tuple  # the work-item that renders it


def pixel_find(launch, film, other):
    """Returns the first pixel whose color differs between two films in any bit, or None."""
    left, top, width, height = map(int, launch.band)
    size = launch.pixel_words * width * height
    differing = np.nonzero(film[:size] != other[:size])[0]
    if len(differing) == 0:
        return None
    at = int(differing[0]) // launch.pixel_words
    x, y = at % width, at // width
    return Pixel(left + x, top + y, at, (x // launch.lanes, y // launch.lanes))


class Record(NamedTuple):
    """What a work-item recorded at a site once."""
    site: instrument.Site
    values: list  # the operands, then the result unless the site is an entry; a pointer or a struct is None

    @property
    def operands(self):
        """The operands, or the parameters of an entry."""
        return self.values if self.site.is_entry else self.values[:-1]


def records(words, sites):
    """Yields pairs of the position after a record and the record, from the words of a trace. Ends before a truncated record."""
    words = words.tolist()
    at = 0
    try:
        while at < len(words):
            site, values = sites[words[at]], []
            at += 1
            for _ in range(site.count):
                value, at = instrument.read_value(words, at)
                values.append(value)
            yield at, Record(site, values)
    except IndexError:
        return


class Finding(NamedTuple):
    """The first difference between two traces, and the entries of functions since the last camera ray."""
    kind: str  # operation, data or branch
    ours: Record  # of the suspect
    theirs: Record
    entries: list

    @property
    def site(self):
        """The suspect's site."""
        return self.ours.site

    def first_lane(self):
        """Returns the number of lanes of the results and the first that differs."""
        ours, theirs = (record.values[-1].lanes for record in (self.ours, self.theirs))
        return len(ours), [a == b for a, b in zip(ours, theirs)].index(False)

    @property
    def right(self):
        """Returns the only right result, or None if several are allowed or the operation is unknown."""
        return exact(self.site.operation, self.ours.operands, self.ours.values[-1])


class Search:
    """The comparison of a suspect with a reference by one launch.

    pixel: the first Pixel that differs, or None. bits: its color by the suspect and by the reference, as words. sites: all sites of the
    program. `find` sets them.
    """

    def __init__(self, launch, suspect, reference, definitions=()):
        """definitions: the macros that the suspect's compiler defines, as MACRO or MACRO=VALUE."""
        self.launch, self.suspect, self.reference = launch, suspect, reference
        self.program = launch.program(tuple(definitions))
        self.pixel, self.bits, self.sites = None, [], []

    def color(self, film):
        """Returns the pixel's color in a film, as words."""
        return film[self.launch.pixel_words * self.pixel.at:][:self.launch.pixel_words].tolist()

    def trace_arguments(self, begin, size):
        """Returns the arguments of an instrumented kernel, which records `size` words of the pixel's work-item from the word `begin` on."""
        return [np.concatenate([np.array([0, begin, size], np.uint32), np.zeros(size, np.uint32)]), *map(np.uint32, self.pixel.item)]

    def is_equal(self, selected, device=None):
        """Returns whether a device renders the reference's pixel with the selected sites recorded, or with no trace if None."""
        text = instrument.Generator().visit(self.program) if selected is None else instrument.Instrumenter(self.program, selected).text
        extra = () if selected is None else self.trace_arguments(0, 0)
        return self.color((device or self.suspect).run(self.launch, text, self.pixel.item, extra)[0]) == self.bits[1]

    def find(self):
        """Returns a Finding, a smallest list of indices of sites whose recording makes the difference vanish, or None if no pixel differs.
        Raises Failure if neither can be found."""
        films = [device.run(self.launch, self.launch.text)[0] for device in (self.suspect, self.reference)]
        self.pixel = pixel_find(self.launch, *films)
        if self.pixel is None:
            return None
        self.bits = [self.color(film) for film in films]
        traced = instrument.Instrumenter(self.program)
        self.sites = traced.sites
        if not self.is_equal(range(len(traced.sites)), self.reference):
            raise Failure("the reference has other bits once operations are recorded; choose another one")
        return self.vanished(traced) if self.is_equal(range(len(traced.sites))) else self.compare(traced.text)

    def compare(self, text):
        """Returns the first difference between the traces of the pixel's work-item."""
        begin, entries, first_other = 0, [], None
        while True:
            traces, totals = [], []
            for device in (self.suspect, self.reference):
                _, (words,) = device.run(self.launch, text, self.pixel.item, self.trace_arguments(begin, TRACE_WORDS))
                totals.append(int(words[0]))
                traces.append(words[instrument.HEAD:][:min(totals[-1] - begin, TRACE_WORDS)])
            end = 0
            for (end, ours), (_, theirs) in zip(records(traces[0], self.sites), records(traces[1], self.sites)):
                if ours.site.is_entry:
                    entries = [] if ours.site.function == "camera_ray" else entries
                    entries.append(ours)
                if ours.site is not theirs.site:
                    return first_other or Finding("branch", ours, theirs, entries)
                if ours == theirs:
                    continue
                is_known = ours.operands == theirs.operands and None not in ours.values + theirs.values
                finding = Finding("operation" if is_known else "data", ours, theirs, entries[:])
                if finding.kind == "operation" and self.is_wrong(finding):
                    return finding
                first_other = first_other or finding
            begin += end
            if end == 0 or begin >= min(totals):
                if first_other is None:
                    raise Failure("every recorded operation agrees: the difference is in what stores the pixel")
                return first_other

    def is_wrong(self, finding):
        """Returns whether a result must be wrong. Bits of NaNs may differ, and quotients and roots that the kernel repairs."""
        is_of_nan = finding.site.operation.startswith("as_") and NAN.get(finding.ours.operands[0].type) in finding.ours.operands[0].lanes
        is_repaired = self.launch.repairs_divide and finding.site.function.startswith(("device_", "uniform_"))
        return finding.right is not None and not is_of_nan and not is_repaired

    def vanished(self, traced):
        """Returns a smallest list of indices of sites whose recording makes the difference vanish, within a smallest list of functions."""
        if self.is_equal(None):
            raise Failure("the preprocessed text gives equal pixels, so the difference is in a part of it for certain compilers, such as "
                          "#ifdef __clang__; define the macros that the compiler has by --define")
        if self.is_equal([]):
            raise Failure("the difference vanishes as soon as functions have another parameter")
        _, (words,) = self.reference.run(self.launch, traced.text, self.pixel.item, self.trace_arguments(0, TRACE_WORDS))
        used = {id(record.site) for _, record in records(words[instrument.HEAD:][:int(words[0])], self.sites)}
        indices = [index for index, site in enumerate(self.sites) if id(site) in used]
        functions = [*dict.fromkeys(self.sites[index].function for index in indices)]

        def within(some):
            return [index for index in indices if self.sites[index].function in some]
        return smallest(within(smallest(functions, lambda some: self.is_equal(within(some)))), self.is_equal)


def smallest(units, holds):
    """Returns a smallest list of units for which `holds` is true, by one binary search per unit. It must hold for all units."""
    kept = []
    while not holds(kept):
        if not units:
            raise Failure("recording the same functions does not always make the difference vanish")
        low, high = 1, len(units)
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if holds(kept + units[:middle]) else (middle + 1, high)
        kept.append(units[low - 1])
        units = units[:low - 1]
    return kept


def type_name(value):
    """Returns the type of a value in OpenCL C. A bool is stored as an int."""
    name = "int" if value.type == "bool" else value.type
    return name if len(value.lanes) == 1 else f"{name}{len(value.lanes)}"


def words_of(value):
    """Returns the bits of a value's lanes as 32-bit words, the lower half of 64 bits first."""
    return [word for bits in value.lanes for word in ([bits & 0xFFFFFFFF, bits >> 32] if value.type in ("long", "ulong", "double") else [bits])]


ALONE = """\
// {title}
// Run by: python3 -m glint.locate --run FILE
// options: {options}
// inputs: {inputs}
// expected: {expected} ({right})
// The inputs come from memory, 32 words each, so that no compiler computes the result.
#pragma OPENCL FP_CONTRACT OFF
kernel void operation(global const uint *inputs, global uint *result)
{{
{loads}
    *(global {result} *)result = {form};
}}
"""


def program_write(path, finding, launch):
    """Writes the operation of a finding as a separate program, with the bits of its operands and of the right result or, if the standard allows
    several, the reference's."""
    names = "abcdefgh"[:len(finding.ours.operands)]
    result, right = finding.ours.values[-1], finding.right
    inputs, loads = [], []
    for place, (name, value) in enumerate(zip(names, finding.ours.operands)):
        inputs += (words_of(value) + [0] * 32)[:32]
        loads.append(f"    {type_name(value)} {name} = *(global const {type_name(value)} *)(inputs + {32 * place});  // {value}")
    expected = right or finding.theirs.values[-1]
    path.write_text(ALONE.format(
        title=f"{finding.site.form.format(*names)}, of {finding.site.function}, {finding.site.place}", options=shlex.join(launch.options),
        inputs=" ".join(f"{word:x}" for word in inputs), expected=" ".join(f"{word:x}" for word in words_of(expected)),
        right=f"{expected}, {'exact' if right else 'of the reference'}", loads="\n".join(loads), result=type_name(result),
        form=finding.site.form.format(*names)), encoding="utf-8")


def program_run(path, device):
    """Runs a program that program_write wrote. Returns its result and the expected one as lists of words."""
    text = Path(path).read_text(encoding="utf-8")
    found = [re.search(rf"(?m)^// {name}: ([^(\n]*)", text) for name in ("options", "inputs", "expected")]
    if not all(found):
        raise Failure(f"{path}: not a program that glint locate wrote")
    options, inputs, expected = (match[1] for match in found)
    kernel = device.kernel(text, "operation", shlex.split(options))
    result = device.buffer(bytes(128))
    kernel(device.queue, (1,), None, device.buffer(np.array([int(word, 16) for word in inputs.split()], np.uint32)), result)
    expected = [int(word, 16) for word in expected.split()]
    return device.read(result)[:len(expected)].tolist(), expected


def describe_ray(entries):
    """Describes the sample, ray and hits of a work-item after the entries, which are those of functions since its camera ray."""
    names = [entry.site.function for entry in entries]
    value = {(at, name): number(value.type, value.lanes[0])
             for at, entry in enumerate(entries) for name, value in zip(entry.site.names, entry.values)}
    text = f"sample {value.get((0, 'index'), 0)}" if names[:1] == ["camera_ray"] else "no camera ray"
    if "rays_shade" in names:
        text += f", ray {names.count('rays_shade')} of its tree"
    queries = [at for at, name in enumerate(names) if name == "traversal_begin"]
    if queries:
        lights = [value[at, "index"] for at, name in enumerate(names[:queries[-1]]) if name == "light_reach"]
        is_shadow = value.get((queries[-1], "query")) == 2 and lights
        text += f", last query: {f'shadow of light {lights[-1]}' if is_shadow else 'closest hit'}"
    hits = [str(value[at, "id"]) for at, name in enumerate(names) if name.startswith("traversal_record") and (at, "id") in value]
    return text + (f", hits recorded: {' '.join(hits)}" if hits else "")


def report(search, found, path):
    """Yields the finding as lines for the user. Writes an operation's program to `path`."""
    suspect, reference = search.suspect, search.reference
    yield f"pixel {search.pixel.x},{search.pixel.y}: color " + " instead of ".join(" ".join(f"{bits:08x}" for bits in color) for color in search.bits)
    if isinstance(found, list):
        yield "No recorded operation differs, since recording it makes the difference vanish: the compiler gets it wrong in its surroundings."
        yield "The difference vanishes as soon as " + ("this is" if len(found) == 1 else "these are") + " recorded:"
        for site in (search.sites[index] for index in found):
            yield f"  {site.place}, {site.function}: {'its parameters' if site.is_entry else site.operation + ', ' + site.form}"
        return
    site = found.site
    yield describe_ray(found.entries)
    if found.kind == "branch":
        yield f"Control flow differs although every operation before agrees: {site.place}, {site.function}, instead of " \
              f"{found.theirs.site.place}, {found.theirs.site.function}"
    elif found.kind == "data":
        yield f"{site.place}, {site.function}: {'parameters differ' if site.is_entry else f'operands differ, {site.form}'}"
        yield "Every operation before agrees, so what is not recorded is wrong: a load, a store, a copy, ++, && or a vector's parts."
        for ours, theirs in zip(found.ours.operands, found.theirs.operands):
            yield f"  {ours}" + (f" instead of {theirs}" if ours != theirs else "")
    else:
        count, lane = found.first_lane()
        yield f"{site.place}, {site.function}: {site.operation}, {site.form}" + (f", lane {lane} of {count}" if count > 1 else "")
        for at, value in enumerate(found.ours.operands):
            yield f"  {{{at}}} = {value.lane(lane)}"
        for device, record in (suspect, found.ours), (reference, found.theirs):
            verdict = "" if found.right is None else ": right" if found.right == record.values[-1] else ": WRONG"
            yield f"  {record.values[-1].lane(lane)} by {device.name}{verdict}"
        yield f"  {found.right.lane(lane)} is exact" if found.right else "  The standard allows more than one result."
        program_write(path, found, search.launch)
        result, expected = program_run(path, suspect)
        yield f"{path} " + ("repeats it" if result != expected else
                            "gives the right result: the compiler gets the operation wrong in its surroundings")


def device_find(name):
    """Returns the first device that an index or a part of "PLATFORM, DEVICE" in any case names. Raises Failure with the devices if none does."""
    devices = [device for platform in cl.get_platforms() for device in platform.get_devices()]
    found = [device for index, device in enumerate(devices)
             if name == str(index) or not name.isdigit() and name.lower() in f"{device.platform.name}, {device.name}".lower()]
    if not found:
        raise Failure(f"no device \"{name}\"; there are: " + "; ".join(f"{i}: {each.platform.name}, {each.name}" for i, each in enumerate(devices)))
    return found[0]


def launch_read(path):
    """Returns the launch of a file. Raises Failure if it is not one."""
    try:
        return Launch(path)
    except (KeyError, TypeError, ValueError) as error:
        raise Failure(f"{path}: not a launch that glint captured") from error


def launches_read(folder):
    """Returns the launches of a folder that render all pixels, in the order in which they were captured. Raises Failure if there is none, or one
    at a precision at which devices may differ."""
    launches = [launch_read(path) for path in sorted(folder.glob("*.json"), key=lambda path: path.stat().st_mtime_ns)]
    launches = [launch for launch in launches if launch.kernel == "render" and "#define IS_PIXEL_LIST 0" in launch.text]
    if not launches:
        raise Failure(f"{folder}: no launch of the kernel render for all pixels")
    for launch in launches:
        if "#define IS_STRICT 1" not in launch.text and "#define IS_DOUBLE 1" not in launch.text:
            raise Failure(f"{folder}: captured at single, where devices may differ; use --precision strict or double")
    return launches


def command_run(options, compiler):
    """Runs the command with its parsed options, prints the result and returns the exit status. compiler: the suspect's, see Device."""
    suspect_options = shlex.split(options.device_options)
    if options.run:
        result, expected = program_run(options.run, Device(device_find(options.device or "0"), options=suspect_options))
        for name, words in ("result", result), ("expected", expected):
            print(f"{name}: {' '.join(f'{word:08x}' for word in words)}")
        return 3 * (result != expected)
    launches = launches_read(options.folder)
    suspect = Device(device_find(options.device or launches[0].device), compiler, suspect_options)
    reference = Device(device_find(options.reference), options=shlex.split(options.reference_options))
    for launch in launches:
        search = Search(launch, suspect, reference, options.define)
        found = search.find()
        if found is not None:
            print(*report(search, found, options.output), sep="\n")
            return 3
    print(f"{len(launches)} launch{'es' if len(launches) > 1 else ''}: no pixel differs between {suspect.name} and {reference.name}")
    return 0


class Parser(argparse.ArgumentParser):
    """A parser that exits with 1 for a wrong command line, because 2 means that a device failed."""

    def error(self, message):
        self.print_usage(sys.stderr)
        self.exit(1, f"{self.prog}: {message}\n")


def main(arguments=None, compiler=lambda text: text):
    """Runs the command and returns its exit status: 0 if no pixel differs, 1 for a user's mistake, 2 if a device failed, 3 if a pixel or a
    result differs. compiler: the suspect's, which tests replace."""
    parser = Parser(prog="glint locate", description="Finds the operation that an OpenCL device computes differently from another.")
    parser.add_argument("folder", nargs="?", type=Path, help="of glint render --capture")
    parser.add_argument("--device", help="index or part of the name of the suspect (default: the device of the capture)")
    parser.add_argument("--reference", default="portable computing language", help="index or part of the name of the reference (default: PoCL)")
    parser.add_argument("--device-options", default="", help="for the suspect's compiler, after those of the capture")
    parser.add_argument("--reference-options", default="", help="such as -cl-opt-disable, which makes the suspect a reference")
    parser.add_argument("--define", action="append", default=[], metavar="MACRO[=VALUE]", help="that the suspect's compiler defines")
    parser.add_argument("-o", "--output", type=Path, default=Path("operation.cl"), help="the program that is written (default: %(default)s)")
    parser.add_argument("--run", type=Path, metavar="FILE", help="run a program that was written")
    options = parser.parse_args(arguments)
    if not options.run and not options.folder:
        parser.error("no folder given")
    try:
        return command_run(options, compiler)
    except subprocess.CalledProcessError as error:
        print(f"glint locate: the C preprocessor failed: {error.stderr or error}", file=sys.stderr)
        return 1
    except (Failure, cl.Error, OSError, instrument.ParseError) as error:
        print(f"glint locate: {error}", file=sys.stderr)
        return 2 if isinstance(error, cl.Error) else 1


if __name__ == "__main__":
    sys.exit(main())
