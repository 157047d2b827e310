#!/usr/bin/env -S python3 -B
"""Checks that python3 -m glint.locate finds the operation that a compiler gets wrong, where and for which operands. Suspect and
reference are one device, but the suspect's compiler reads the text after a mutation, which knows nothing of how operations are
recorded.

run_tests: sanitize-long-only"""
import functools
import io
import itertools
import os
import re
import sys
import unittest.mock
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

from glint import IS_LONG, IS_SANITIZED, ROOT, TestCase, main, need_device, need_modules, run, skip_all, write

if IS_SANITIZED:
    skip_all("Python does not start with a sanitizer's runtime")
need_modules("numpy=numpy==2.4.6", "pyopencl=pyopencl==2026.1.4", "pycparserext=pycparserext==2026.1 pycparser==3.0")
DEVICE = need_device()["name"]
os.environ["OCL_ICD_VENDORS"] = os.environ.get("OCL_ICD_VENDORS", "/etc/OpenCL/vendors")
sys.path.insert(0, str(ROOT / "host/python"))
os.environ["GLINT_LIBRARY"] = str(ROOT / os.environ.get("BUILD", "build") / "libglint.so.1")
del sys.modules["glint"]  # the tests' own module, not the package
import numpy as np  # noqa: E402
from glint import _exact, _instrument, locate  # noqa: E402
from pycparser import c_ast  # noqa: E402
from pycparserext.ext_c_parser import OpenCLCParser  # noqa: E402

SCENE = """\
camera: {position: [0, 1.5, -4], look_at: [0, 0.4, 0], fov: 60}
lights: [{point: {position: [3, 4, -5]}}]
objects:
  - sphere: {center: [0, 0.5, 0], radius: 1, material: {color: [0.8, 0.1, 0.1], specular: 0.4}}
"""
if IS_LONG:
    SCENE = SCENE.replace("0.4}}", "0.4, reflection: 0.3}}") + """\
  - sphere: {center: [1.2, 0.2, -1], radius: 0.3}
  - plane: {point: [0, -0.5, 0], normal: [0, 1, 0], material: {checker: {colors: [0.9, 0.2], size: 1}}}
"""


class Mutant(NamedTuple):
    """A compiler that computes one type of operation wrong for some results r or first operands a, given as their lowest words."""
    operation: str
    kind: str = "float"  # of the result
    when: str = "(r & 15) == 5"
    flips: str = "1"  # in the result
    function: str = ""  # the only one where it does so; all if empty
    nested: str = ""  # only where an operand is this operation, which a record separates from it
    precision: str = "strict"
    lanes: int = 1


MUTANTS = [
    Mutant("fma"), Mutant("sqrt"), Mutant("fma", function="difference_of_products"), Mutant("convert_int", "int", "1"),
    Mutant("+"), Mutant("-"), Mutant("*"), Mutant("/"), Mutant("floor", when="1", flips="0x400000"), Mutant("fabs", flips="0x80000000"),
    Mutant("neg"), Mutant("select"), Mutant("<", "int", "(a & 63) == 9"), Mutant(">", "int", "(a & 63) == 9"),
    Mutant("==", "int", "(a & 63) == 9", function="vector_normalize"),
    Mutant("convert_float", when="r != 0"), Mutant("convert", when="r == 0x40000000"), Mutant("as_float", when="1", flips="0x400000"),
    Mutant("+", "int", "(r & 15) == 5", function="camera_ray"), Mutant("*", "int", "(r & 15) == 4", function="camera_ray"),
    Mutant(">>", "uint", "1", function="rays_shade"), Mutant("<<", "uint", "1", function="rays_shade"),
    Mutant("&", "int", "1", function="traversal_record"),
    Mutant("*", function="vector_dot"), Mutant("-", function="two_sum"),
    Mutant("*", "double", precision="double"), Mutant("+", "double", precision="double"), Mutant("sqrt", "double", precision="double"),
    Mutant("fma", "float4", lanes=4), Mutant("select", "float4", lanes=4),
    Mutant("fma", function="difference_of_products", nested="neg", when="1", flips="0x80000000"),
    Mutant("+", function="pair_vector_dot_once", nested="+", when="r != 0", flips="0x08000000"),
]


class Parser(OpenCLCParser):
    """pycparser 3.0 reads a statement expression only where no operator follows it."""

    def _parse_assignment_expression(self):
        is_statement = self._peek_type() == "LPAREN" and self._peek_type(2) == "LBRACE"
        return self._parse_conditional_expression() if is_statement else super()._parse_assignment_expression()

    def _parse_primary_expression(self):
        if self._peek_type() != "LPAREN" or self._peek_type(2) != "LBRACE":
            return super()._parse_primary_expression()
        self._advance()
        body = self._parse_compound_statement()
        self._expect("RPAREN")
        return body


@functools.lru_cache
def parsed(text):
    return _instrument.parse(_instrument.preprocess(text, []), Parser)


def operation_of(node):
    """Returns the operation of a node and its operands."""
    if isinstance(node, c_ast.BinaryOp):
        return node.op, [node.left, node.right]
    if isinstance(node, c_ast.UnaryOp) and node.op == "-":
        return "neg", [node.expr]
    if isinstance(node, c_ast.TernaryOp):
        return "select", [node.cond, node.iftrue, node.iffalse]
    if isinstance(node, c_ast.Cast) and not isinstance(node.expr, c_ast.ExprList):
        return "convert", [node.expr]
    if isinstance(node, c_ast.FuncCall) and node.args:
        return node.name.name, node.args.exprs
    return None, []


class Compiler(_instrument.Generator):
    def __init__(self, mutant):
        super().__init__()
        self.mutant, self.function, self.count = mutant, None, 0

    def __call__(self, text):
        return self.visit(parsed(text))

    def visit_FuncDef(self, n):
        self.function = n.decl.name
        text = self.visit(n.decl) + "\n" + super().visit_Compound(n.body) + "\n"
        self.function = None
        return text

    def _generate_stmt(self, n, add_indent=False):
        return super().visit_Compound(n) if isinstance(n, c_ast.Compound) else super()._generate_stmt(n, add_indent)

    def visit_Compound(self, n):  # a statement expression, for no statement comes here
        return f"({super().visit_Compound(n)})"

    def _generate_type(self, *arguments, **options):  # the size of an array is a constant
        function, self.function = self.function, None
        text = super()._generate_type(*arguments, **options)
        self.function = function
        return text

    def visit(self, node):
        operation, operands = operation_of(node)
        text = super().visit(node)
        mutant = self.mutant
        is_there = self.function and not self.function.startswith("trace_") and mutant.function in ("", self.function)
        if operation != mutant.operation or not operands or not is_there:
            return text
        if all(map(_instrument.is_constant, operands)) or mutant.nested and mutant.nested not in (operation_of(operand)[0] for operand in operands):
            return text
        self.count += 1
        a, r = f"ma{self.count}", f"mr{self.count}"
        first = f"__auto_type {a} = ({self.visit(operands[0])}); " if re.search(r"\ba\b", mutant.when) else ""
        integer = "ulong" if mutant.kind == "double" else "uint"
        is_kind = f"__builtin_types_compatible_p(__typeof__({r}), {mutant.kind})"
        when = re.sub(r"\b[ar]\b", lambda found: f"*(private uint *)&{a if found[0] == 'a' else r}", mutant.when)
        flip = f"if ({is_kind} && ({when})) *(private {integer} *)&{r} ^= {mutant.flips};"
        return f"({{ {first}__auto_type {r} = ({text}); {flip} {r}; }})"


def captured(precision="strict", lanes=1):
    """Returns the launch of the scene, captured into a folder named by precision and lanes."""
    write("scene.yaml", SCENE)
    folder = f"{precision}-{lanes}"
    process = run(f"render scene.yaml --precision {precision} --lanes {lanes} --size 32x24 --samples 2 --capture {folder} --quiet "
                  "--build-options=-cl-opt-disable")
    assert process.returncode == 0, process.stderr
    return next(locate.Launch(path) for path in Path(folder).glob("*.json"))


class Mutants(TestCase):
    def setUp(self):
        super().setUp()
        self.device = locate.device_find(DEVICE)

    def test_mutants(self):
        """At least nine of ten mutants are found, with operation, function, operands and exact result, or what of these can be found."""
        mutants = MUTANTS if IS_LONG else MUTANTS[2:4]
        launches = {variant: captured(*variant) for variant in {(mutant.precision, mutant.lanes) for mutant in mutants}}
        reference = locate.Device(self.device)
        failures = []
        for mutant in mutants:
            try:
                self.check(mutant, locate.Search(launches[mutant.precision, mutant.lanes], locate.Device(self.device, Compiler(mutant)), reference))
            except (AssertionError, locate.Failure) as failure:
                failures.append(f"{mutant}: {failure}")
        print(f"{len(mutants) - len(failures)} of {len(mutants)} mutants located", *failures, sep="\n")
        self.assertLessEqual(len(failures), len(mutants) // 10, "\n".join(failures))

    def check(self, mutant, search):
        found = search.find()
        self.assertIsNotNone(found, "no pixel differs")
        lines = "\n".join(locate.report(search, found, Path("operation.cl")))
        if mutant.nested:
            for site in (search.sites[number] for number in found):
                self.assertEqual(site.function, mutant.function, lines)
                self.assertIn(site.operation, (mutant.operation, mutant.nested), lines)
            return
        self.assertEqual((found.kind, found.site.operation), ("operation", mutant.operation), lines)
        self.assertIn(mutant.function, ("", found.site.function), lines)
        self.assertEqual(found.right, found.theirs.values[-1], lines)
        self.assertRegex(lines, r"(?m)^  .*: WRONG\n  .*: right\n  .* is exact$")
        self.assertIn("operation.cl " + ("gives the right result" if mutant.function else "repeats it"), lines)
        self.assertEqual(*locate.program_run("operation.cl", search.reference))


class Parts(TestCase):
    def test_smallest(self):
        for wanted in [], [3], [0, 1, 7], [5, 6]:
            self.assertEqual(sorted(locate.smallest([*range(8)], lambda some, wanted=wanted: set(wanted) <= set(some))), wanted)
        with self.assertRaises(locate.Failure):
            locate.smallest([1, 2], lambda some: False)

    def test_group_fit(self):
        """A work-group is reduced as the launch reduced it (tests/test_opencl_compose.c)."""
        for group, most, sides, expected in (([8, 8], 64, [64, 64, 64], [8, 8]), ([8, 8], 32, [64, 64, 64], [8, 4]), ([8, 8], 16, [4, 8, 64], [4, 4]),
                                             ([8, 8], 64, [4, 8, 64], [4, 8]), ([8, 8], 1, [64, 64, 64], [1, 1]), ([16], 64, [4, 1, 1], [4])):
            device, kernel = locate.Device.__new__(locate.Device), unittest.mock.Mock()
            device.device = unittest.mock.Mock(max_work_item_sizes=sides, max_work_group_size=most)
            kernel.get_work_group_info.return_value = 64
            self.assertEqual(device.group_fit(kernel, group), expected)

    def test_exact(self):
        """Results are numpy's, which are the processor's, for all kinds of operands."""
        generator = np.random.default_rng(1)
        for kind, real, word in ("float", np.float32, np.uint32), ("double", np.float64, np.uint64):
            info = np.finfo(real)
            special = np.array([0, -0.0, 1, -1, np.inf, -np.inf, np.nan, info.tiny, info.smallest_subnormal, info.max, 1 + info.eps, 0.5], real)
            random = generator.integers(0, np.iinfo(word).max, 60, word).view(real)
            numbers = np.concatenate([special, random, generator.normal(size=60).astype(real)])
            for a, b in itertools.product(numbers[::1 if IS_LONG else 12], numbers):
                operands = [_exact.Value(kind, (int(value.view(word)),)) for value in (a, b)]
                with np.errstate(all="ignore"):
                    results = {"+": a + b, "-": a - b, "*": a * b, "/": a / b, "sqrt": np.sqrt(a), "floor": np.floor(a), "<": a < b, "!=": a != b,
                               "neg": -a, "fabs": np.abs(a)}
                for operation, result in results.items():
                    is_number = isinstance(result, real)
                    bits = _exact.NAN[kind] if is_number and np.isnan(result) else int(result.view(word)) if is_number else int(result)
                    found = _exact.exact(operation, operands[:1 if operation in ("sqrt", "floor", "neg", "fabs") else 2],
                                         _exact.Value(kind if is_number else "int", (0,)))
                    self.assertEqual(found.lanes, (bits,), f"{a!r} {operation} {b!r}")
        one, tiny = (_exact.Value("float", (int(np.float32(value).view(np.uint32)),)) for value in (1 + 2**-23, -(1 + 2**-22)))
        half, no = _exact.Value("float", (0x3F000000,)), _exact.Value("bool", (0,))
        self.assertEqual(_exact.exact("convert", [half], no).lanes, (1,))
        minus, five = _exact.Value("int", (2**32 - 5,)), _exact.Value("uint", (5,))
        self.assertIn(_exact.exact("abs", [minus], five), (None, five))
        self.assertEqual(_exact.exact("fma", [one, one, tiny], one).lanes, (int(np.float32(2**-46).view(np.uint32)),))

    def test_command(self):
        """`glint locate` starts glint-locate, which reports that there is no difference if it finds none."""
        os.chmod(write("glint-locate", "#!/bin/sh\necho \"$@\"\nexit 3\n"), 0o755)
        self.assertEqual(self.glint("locate a 'b c'", status=3, env={"PATH": f".:{os.environ['PATH']}"}).stdout, "a b c\n")
        self.refuses("locat a", 'unknown command "locat"')
        captured()
        output, errors = io.StringIO(), io.StringIO()
        with redirect_stdout(output), redirect_stderr(errors):
            self.assertEqual(locate.main(["strict-1", "--reference", DEVICE]), 0)
            self.assertEqual(locate.main(["strict-1", "--reference", "no such device"]), 1)
            self.assertEqual(locate.main(["none"]), 1)
            os.mkdir("wrong")
            for text in "{", "[]", '{"kernel": "render"}':
                write("wrong/launch.json", text)
                self.assertEqual(locate.main(["wrong"]), 1)
            self.assertEqual(locate.main(["--run", "wrong/launch.json"]), 1)
            with unittest.mock.patch.object(locate, "report", side_effect=KeyError), self.assertRaises(KeyError):
                locate.main(["strict-1", "--reference", DEVICE], Compiler(Mutant("sqrt")))
            for wrong in [], ["strict-1", "--unknown"]:
                with self.assertRaises(SystemExit) as exit_of_parser:
                    locate.main(wrong)
                self.assertEqual(exit_of_parser.exception.code, 1)
            with unittest.mock.patch.object(locate, "TRACE_WORDS", 200):  # in several parts
                self.assertEqual(locate.main(["strict-1", "--reference", DEVICE, "-o", "found.cl"], Compiler(Mutant("sqrt"))), 3)
            self.assertEqual(locate.main(["--run", "found.cl"]), 0)
        self.assertRegex(output.getvalue(), r"^1 launch: no pixel differs between .* and .*\npixel \d+,\d+: color .*\nsample [01].*\n"
                                            r"perturb\.h:\d+, device_sqrt: sqrt, sqrt\(\{0}\)\n(  .*\n){4}found\.cl repeats it\n"
                                            r"result: ([0-9a-f]{8})\nexpected: \2\n$")
        self.assertRegex(errors.getvalue(), 'no device "no such device"; there are: 0: .*\n.*none: no launch.*\n'
                                            r"(.*wrong/launch\.json: not a launch that glint captured\n){3}.*: not a program that glint locate wrote")


main()
