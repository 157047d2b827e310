"""Makes a kernel record every operator, conversion and call of a built-in function, with its operands and its result.

`a + b` becomes a statement expression, which keeps the types that C gives to operands and result:
    ({ __auto_type a7 = a; __auto_type b7 = b; __auto_type r7 = a7 + b7; trace_id(trace, 7); trace_put(trace, a7); …; r7; })
Each function receives the trace as its first parameter, NULL for work-items that are not traced. Functions overloaded by type store
a value as its type and its bits, and every NaN as the same bits on all devices. Statement expressions, __auto_type and overloading
are extensions of clang, on which OpenCL compilers are based.
"""
import re
import subprocess
from dataclasses import dataclass

from pycparser import c_ast
from pycparser.c_parser import ParseError  # noqa: F401 (locate reports it)
from pycparserext.ext_c_generator import GnuCGenerator
from pycparserext.ext_c_parser import OpenCLCParser

from ._exact import BITS, FORMATS, NAN, Value

TYPES = [f"{base}{lanes}" for base in BITS if base != "bool" for lanes in ("", 2, 3, 4, 8, 16)] + ["bool"]
HEAD = 3  # words before the trace: its number of words, those skipped at its start, and the capacity
PARAMETERS = "global uint *trace_words, uint trace_x, uint trace_y"
START = "  global uint *trace = get_global_id(0) == trace_x && get_global_id(1) == trace_y ? trace_words : 0;\n"
# built-in functions that return nothing, require constant arguments, access memory or are part of control flow
UNRECORDED = re.compile("(v(load|store)|atomic_|prefetch|get_|barrier|mem_fence|__builtin_(expect|prefetch|shufflevector|ia32))")
OPERATORS = {"-": "neg", "!": "!", "~": "~"}


@dataclass(eq=False)
class Site:
    """A place that records: an operation, or the entry of a function with its parameters as operands."""
    operation: str
    function: str
    place: str
    count: int  # the number of values, including the result
    form: str = ""  # the expression, with {0}, {1} … for operands
    names: tuple = ()  # the parameters' names

    @property
    def is_entry(self):
        return self.operation == "enter"


def preprocess(text, definitions):
    """Preprocesses the text with the given macros and otherwise only those of OpenCL."""
    command = ["cpp", "-undef", "-D__OPENCL_VERSION__=120", "-D__ENDIAN_LITTLE__=1", *(f"-D{each}" for each in definitions)]
    return subprocess.run(command, input=text, stdout=subprocess.PIPE, text=True, check=True).stdout


class Names(c_ast.NodeVisitor):
    """Collects the names that occur in a node."""

    def __init__(self, node):
        self.names = set()
        self.visit(node)

    def visit_ID(self, n):
        self.names.add(n.name)


class Pruner(c_ast.NodeVisitor):
    """Removes code that constants rule out, since most features are constants: branches of `if`, and code after `if (1) return`."""

    def visit_If(self, n):
        value = constant_of(n.cond)
        if value == 0:
            n.iftrue = c_ast.EmptyStatement()
        elif value is not None:
            n.iffalse = None
        self.generic_visit(n)

    def visit_Compound(self, n):
        self.generic_visit(n)
        for at, statement in enumerate(n.block_items or []):
            if isinstance(statement, c_ast.If) and isinstance(statement.iftrue, c_ast.Return) and constant_of(statement.cond):
                n.block_items = n.block_items[:at + 1]
                break


def constant_of(n):
    """Returns the value of a condition of constants, or None if it is not constant."""
    if isinstance(n, c_ast.Constant) and n.value.isdigit():
        return int(n.value)
    if isinstance(n, c_ast.UnaryOp) and n.op == "!":
        value = constant_of(n.expr)
        return None if value is None else int(value == 0)
    if isinstance(n, c_ast.BinaryOp) and n.op in ("&&", "||"):
        values, decides = [constant_of(n.left), constant_of(n.right)], int(n.op == "||")
        known = [int(value != 0) for value in values if value is not None]
        return decides if decides in known else 1 - decides if len(known) == 2 else None
    return None


def is_kernel(function):
    return any(str(each).endswith("kernel") for each in function.decl.funcspec)


def parse(text, parser=OpenCLCParser):
    """Parses the program and removes the functions that its kernels do not use, which are most, to save compiling them."""
    program = parser().parse(text, initial_type_symbols={"__auto_type"})
    Pruner().visit(program)
    functions = [each for each in program.ext if isinstance(each, c_ast.FuncDef)]
    names = {}  # names that occur in functions, by the functions' names
    for function in functions:
        names.setdefault(function.decl.name, set()).update(Names(function.body).names)
    used, waiting = set(), {function.decl.name for function in functions if is_kernel(function)}
    while waiting:
        used |= waiting
        waiting = set().union(*(names[name] for name in waiting)) & names.keys() - used
    program.ext = [each for each in program.ext if each not in functions or each.decl.name in used]
    return program


class Generator(GnuCGenerator):
    """Writes OpenCL C, in which a cast may be a vector literal, such as (float4)(a, b), or one with a subscript, (float4)(a)[b]."""

    def visit_Cast(self, n):
        return f"(({self._generate_type(n.to_type, emit_declname=False)})({self.visit(n.expr)}))"


PUT = "static void __attribute__((overloadable, noinline)) trace_put(global uint *trace"


def put_opaque(kind):
    """Returns the function that records that a value is a pointer or a struct."""
    return f"{PUT}, {kind} v) {{ if (trace) trace_word(trace, {len(TYPES)}); }}"


def lane_write(base):
    """Returns the function that stores one number."""
    word, end = ("ulong", "UL") if BITS[base] == 64 else ("uint", "U")
    bits, statements = f"({word})v", ""
    if base in FORMATS:
        bits = f"as_{word}(v)"
        infinity = NAN[base] & NAN[base] << 1  # the exponent's bits
        statements = f"if ((bits << 1) > {infinity << 1 & (1 << BITS[base]) - 1}{end}) bits = {NAN[base]}{end}; "
    statements += "trace_word(trace, (uint)bits);" + (" trace_word(trace, (uint)(bits >> 32));" if word == "ulong" else "")
    return f"static void __attribute__((overloadable)) trace_lane(global uint *trace, {base} v) {{ {word} bits = {bits}; {statements} }}"


def header(has_double):
    """Returns the functions that store values."""
    lines = ["#pragma OPENCL EXTENSION cl_khr_fp64 : enable"] if has_double else []
    lines += ["static void trace_word(global uint *trace, uint word) { uint at = trace[0]++ - trace[1]; if (at < trace[2]) trace[3 + at] = word; }",
              "static void __attribute__((noinline)) trace_id(global uint *trace, uint id) { if (trace) trace_word(trace, id); }"]
    lines += [lane_write(base) for base in BITS if has_double or base != "double"]
    for code, name in enumerate(TYPES):
        if has_double or not name.startswith("double"):
            lanes = "".join(f" trace_lane(trace, v{f'.s{lane:x}' if lane_count(name) > 1 else ''});" for lane in range(lane_count(name)))
            lines.append(f"{PUT}, {name} v) {{ if (!trace) return; trace_word(trace, {code});{lanes} }}")
    lines += [put_opaque(f"{space} const void *") for space in ("global", "local", "private", "constant")]
    return "\n".join(lines) + "\n"


def lane_count(name):
    return int(re.search(r"\d*$", name)[0] or 1)


def read_value(words, at):
    """Returns a value, or None for a pointer or a struct, and the position after it."""
    if words[at] == len(TYPES):
        return None, at + 1
    name = TYPES[words[at]]
    base = name.rstrip("0123456789")
    step = 2 if BITS[base] == 64 else 1
    end = at + 1 + step * lane_count(name)
    mask = (1 << BITS[base]) - 1
    return Value(base, tuple((words[i] | (words[i + 1] << 32 if step == 2 else 0)) & mask for i in range(at + 1, end, step))), end


class Instrumenter(Generator):
    """Writes the program so that it records the selected sites, or all if `selected` is None."""

    def __init__(self, program, selected=None):
        super().__init__()
        self.selected = None if selected is None else set(selected)
        self.sites, self.function, self.is_kernel = [], None, False
        self.functions = {each.decl.name for each in program.ext if isinstance(each, c_ast.FuncDef)}
        self.types = {}
        for each in program.ext:
            if isinstance(each, c_ast.Typedef):
                self.types[each.name] = each.type
        text = self.visit(program)
        self.text = header("double" in text) + text

    def arithmetic(self, kind):
        """Returns the name of a numeric type, or None for another type."""
        while isinstance(kind, (c_ast.Typename, c_ast.TypeDecl)):
            kind = kind.type
        if isinstance(kind, c_ast.Enum):
            return "int"
        if not isinstance(kind, c_ast.IdentifierType):
            return None
        name = " ".join(kind.names)
        if name in self.types:
            return self.arithmetic(self.types[name])
        name = re.sub(r"^unsigned( int)?$", "uint", name).replace("size_t", "ulong")
        return name if name in TYPES else None

    def site_add(self, node, operation, count, **members):
        """Adds a site. Returns its number, or None if it is not to be recorded."""
        self.sites.append(Site(operation, self.function, f"{node.coord.file}:{node.coord.line}", count, **members))
        number = len(self.sites) - 1
        return number if self.selected is None or number in self.selected else None

    def record(self, node, operation, form, operands, plain):
        """Returns the text of an operation on operands, which are nodes. `plain` writes it without recording."""
        if self.function is None or all(map(is_constant, operands)):
            return plain(node)
        number = self.site_add(node, operation, len(operands) + 1, form=form)
        if number is None:
            return plain(node)
        names = [f"t{number}_{at}" for at in range(len(operands))] + [f"t{number}"]
        texts = [*map(self.visit, operands), form.format(*names)]
        variables = " ".join(f"__auto_type {name} = ({text});" for name, text in zip(names, texts))
        return f"({{ {variables} trace_id(trace, {number}); {' '.join(f'trace_put(trace, {name});' for name in names)} {names[-1]}; }})"

    def visit_BinaryOp(self, n):
        plain = super().visit_BinaryOp
        return plain(n) if n.op in ("&&", "||") else self.record(n, n.op, f"{{0}} {n.op} {{1}}", [n.left, n.right], plain)

    def visit_UnaryOp(self, n):
        plain = super().visit_UnaryOp
        return self.record(n, OPERATORS[n.op], f"{n.op}{{0}}", [n.expr], plain) if n.op in OPERATORS else plain(n)

    def visit_Assignment(self, n):
        """Writes `a += b` as `a = a + b`, unless evaluating `a` twice would change the result."""
        if n.op == "=" or not is_pure(n.lvalue, may_read=True):
            return super().visit_Assignment(n)
        return f"{self.visit(n.lvalue)} = {self.visit(c_ast.BinaryOp(n.op[:-1], n.lvalue, n.rvalue, n.coord))}"

    def visit_Cast(self, n):
        plain = super().visit_Cast
        kind = None if isinstance(n.expr, c_ast.ExprList) else self.arithmetic(n.to_type)
        return self.record(n, "convert", f"({kind}){{0}}", [n.expr], plain) if kind else plain(n)

    def visit_TernaryOp(self, n):
        """Records a choice only between pure expressions, since recording evaluates both."""
        plain = super().visit_TernaryOp
        can_compute = is_pure(n.iftrue) and is_pure(n.iffalse)
        return self.record(n, "select", "{0} ? {1} : {2}", [n.cond, n.iftrue, n.iffalse], plain) if can_compute else plain(n)

    def visit_FuncCall(self, n):
        plain = super().visit_FuncCall
        name, arguments = self.visit(n.name), n.args.exprs if n.args else []
        if name in self.functions:
            return f"{name}({', '.join(['trace', *map(self._visit_expr, arguments)])})"
        if not arguments or UNRECORDED.match(name):
            return plain(n)
        return self.record(n, name, f"{name}({', '.join(f'{{{at}}}' for at in range(len(arguments)))})", arguments, plain)

    def visit_Typedef(self, n):
        is_struct = isinstance(n.type, c_ast.TypeDecl) and isinstance(n.type.type, (c_ast.Struct, c_ast.Union))
        return super().visit_Typedef(n) + (f";\n{put_opaque(n.name)}" if is_struct else "")

    def visit_ParamList(self, n):
        given = super().visit_ParamList(n)
        given = "" if given == "void" else given
        return ", ".join(filter(None, [given, PARAMETERS] if self.is_kernel else ["global uint *trace", given]))

    def _generate_type(self, *arguments, **options):
        """Records nothing in a type, such as the size of an array."""
        function, self.function = self.function, None
        text = super()._generate_type(*arguments, **options)
        self.function = function
        return text

    def visit_FuncDef(self, n):
        self.is_kernel = is_kernel(n)
        head = self.visit(n.decl)
        self.function = n.decl.name
        parameters = [] if self.is_kernel or not n.decl.type.args else n.decl.type.args.params
        names = [each.name for each in parameters if not isinstance(each.type, c_ast.PtrDecl) and self.arithmetic(each.type)]
        number = self.site_add(n, "enter", len(names), names=names)
        start = START if self.is_kernel else ""
        if number is not None:
            start += f"  trace_id(trace, {number});" + "".join(f" trace_put(trace, {name});" for name in names) + "\n"
        body = self.visit(n.body)
        self.function = None
        return head + "\n" + body.replace("{\n", "{\n" + start, 1) + "\n"


def is_constant(n):
    """Returns whether the value is a compile-time constant."""
    if isinstance(n, c_ast.Constant) or isinstance(n, c_ast.ID) and n.name.isupper():
        return True
    if isinstance(n, c_ast.Cast) or isinstance(n, c_ast.UnaryOp) and n.op in ("-", "~", "+"):
        return not isinstance(n.expr, c_ast.InitList) and is_constant(n.expr)
    if isinstance(n, c_ast.ExprList):
        return all(map(is_constant, n.exprs))
    return isinstance(n, c_ast.BinaryOp) and is_constant(n.left) and is_constant(n.right)


def is_pure(n, may_read=False):
    """Returns whether evaluating the expression has no effect and cannot fail. `may_read` permits it to read elements."""
    if isinstance(n, (c_ast.ID, c_ast.Constant)):
        return True
    if isinstance(n, c_ast.StructRef):
        return is_pure(n.name, may_read)
    if isinstance(n, c_ast.ArrayRef):
        return may_read and is_pure(n.name, True) and is_pure(n.subscript, True)
    if isinstance(n, c_ast.UnaryOp):
        return n.op in ({"-", "~", "!", "*"} if may_read else {"-", "~", "!"}) and is_pure(n.expr, may_read)
    if isinstance(n, c_ast.Cast):
        return not isinstance(n.expr, c_ast.InitList) and is_pure(n.expr, may_read)
    return isinstance(n, c_ast.BinaryOp) and n.op not in {"/", "%"} and is_pure(n.left, may_read) and is_pure(n.right, may_read)
