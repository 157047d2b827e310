"""Computes operations of OpenCL C with integers and fractions only, so that no floating-point unit has to be trusted.

A value is a type and the bits of each lane. NaNs count as equal, with the bits of NAN.
"""
import math
import operator
import re
import struct
from fractions import Fraction
from typing import NamedTuple

BITS = {"bool": 1, "char": 8, "uchar": 8, "short": 16, "ushort": 16, "int": 32, "uint": 32, "long": 64, "ulong": 64, "float": 32, "double": 64}
SIGNED = {"char", "short", "int", "long"}
FORMATS = {"float": ("<f", "<I", 24, -126), "double": ("<d", "<Q", 53, -1022)}  # packing, digits, smallest normal exponent
NAN = {"float": 0x7FC00000, "double": 0x7FF8 << 48}
COMPARISONS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne}
INTEGERS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "&": operator.and_, "|": operator.or_, "^": operator.xor, "~": operator.invert,
            "neg": operator.neg, "min": min, "max": max}
ROUNDINGS = {"floor": math.floor, "ceil": math.ceil, "trunc": math.trunc, "rint": round}


class Value(NamedTuple):
    type: str
    lanes: tuple

    def lane(self, at):
        return self if len(self.lanes) == 1 else self._replace(lanes=self.lanes[at:at + 1])

    def __str__(self):
        lanes = [f"{number(self.type, bits)!r} (0x{bits:0{max(BITS[self.type] // 4, 1)}x})" for bits in self.lanes]
        return f"{self.type}{len(lanes)}({', '.join(lanes)})" if len(lanes) > 1 else f"{self.type} {''.join(lanes)}"


class Undefined(Exception):
    """Raised if the standard allows more than one result."""


def number(kind, bits):
    """Returns a lane as an int or a float. Python's float represents every float and double."""
    if kind in FORMATS:
        return struct.unpack(FORMATS[kind][0], struct.pack(FORMATS[kind][1], bits))[0]
    return bits - (1 << BITS[kind]) if kind in SIGNED and bits >> (BITS[kind] - 1) else bits


def bits_of(kind, value):
    """Returns the bits of an int, float or fraction, rounded to nearest with ties to even, or modulo the type's range."""
    if kind == "bool":
        return int(value != 0)
    if kind not in FORMATS:
        if isinstance(value, float) and not math.isfinite(value):
            raise Undefined
        return math.trunc(value) & ((1 << BITS[kind]) - 1)
    packing, integer, digits, smallest = FORMATS[kind]
    if isinstance(value, float) and math.isnan(value):
        return NAN[kind]
    if isinstance(value, float) and (value == 0 or math.isinf(value)):
        return struct.unpack(integer, struct.pack(packing, value))[0]
    size = abs(Fraction(value))
    exponent = size.numerator.bit_length() - size.denominator.bit_length()
    exponent -= size < Fraction(2) ** exponent
    quantum = Fraction(2) ** (max(exponent, smallest) - digits + 1)
    rounded = round(size / quantum) * quantum
    magnitude = float(rounded) if rounded < Fraction(2) ** (2 - smallest) else math.inf
    return struct.unpack(integer, struct.pack(packing, -magnitude if value < 0 else magnitude))[0]


def root(value):
    """Returns a fraction's root with enough digits to round correctly. If it is inexact, the last digit is odd."""
    scale = 2 ** (128 + 2 * abs(value.numerator.bit_length() - value.denominator.bit_length()))
    scaled = value.numerator * scale * scale // value.denominator
    whole = math.isqrt(scaled)
    return Fraction(2 * whole + (Fraction(whole, scale) ** 2 != value), 2 * scale)


def of_floats(operation, numbers):
    """Returns the result of an operation on floats, as a float or a fraction that is not rounded yet."""
    a, b, c = (*numbers, 0.0, 0.0)[:3]
    if operation in ("fmin", "fmax", "min", "max"):
        if any(map(math.isnan, numbers)):
            if operation in ("min", "max") or math.isnan(a) and math.isnan(b):
                raise Undefined
            return b if math.isnan(a) else a
        if a == b == 0 and math.copysign(1, a) != math.copysign(1, b):
            raise Undefined
        return (min if operation.endswith("min") else max)(a, b)
    if any(map(math.isnan, numbers)):
        return math.nan
    if operation in ROUNDINGS:
        return a if a == 0 or math.isinf(a) else math.copysign(float(ROUNDINGS[operation](Fraction(a))), a)
    if operation == "sqrt":
        return a if a == 0 or a == math.inf else math.nan if a < 0 else root(Fraction(a))
    is_finite = all(map(math.isfinite, numbers))
    if operation == "fma":
        if is_finite and a != 0 and b != 0:
            return Fraction(a) * Fraction(b) + Fraction(c) or 0.0
        return c if math.isfinite(a) and math.isfinite(b) and math.isinf(c) else a * b + c
    if operation == "/" and b == 0:
        return math.nan if a == 0 else math.copysign(math.inf, a) * math.copysign(1, b)
    if operation not in ("+", "-", "*", "/"):
        raise Undefined
    apply = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}[operation]
    if is_finite and a != 0 and b != 0:
        return apply(Fraction(a), Fraction(b)) or 0.0
    return apply(a, b)


def common_type(*kinds):
    """Returns the type in which the operands of a comparison are compared."""
    ranks = list(BITS)
    return max((kind if BITS[kind] >= 32 else "int" for kind in kinds), key=ranks.index)


def of_lane(operation, kind, operands):
    """Returns the bits of one lane of the result, whose type is `kind`. Operands are pairs of type and bits."""
    (first, bits), numbers = operands[0], [number(*operand) for operand in operands]
    if operation in COMPARISONS:
        shared = common_type(*(of for of, _ in operands))
        return COMPARISONS[operation](*(number(shared, bits_of(shared, value)) for value in numbers))
    if operation == "!":
        return not numbers[0]
    sign = 1 << (BITS[kind] - 1)
    if kind in FORMATS and operation in ("neg", "fabs", "copysign"):
        if math.isnan(numbers[0]):
            return NAN[kind]
        return bits ^ sign if operation == "neg" else bits & ~sign | (operands[1][1] & sign if operation == "copysign" else 0)
    if operation == "convert":
        if kind not in FORMATS and kind != "bool" and first in FORMATS and number(kind, bits_of(kind, numbers[0])) != math.trunc(numbers[0]):
            raise Undefined  # outside the integer type's range
        return bits_of(kind, numbers[0])
    if operation in ("<<", ">>"):
        amount = numbers[1] % BITS[kind]
        return bits_of(kind, numbers[0] << amount if operation == "<<" else numbers[0] >> amount)
    if operation == "clz":
        return BITS[kind] - bits.bit_length()
    if operation == "mul_hi":
        return bits_of(kind, numbers[0] * numbers[1] >> BITS[kind])
    converted = [number(kind, bits_of(kind, value)) for value in numbers]
    if operation == "clamp" and kind not in FORMATS:
        return bits_of(kind, min(max(converted[0], converted[1]), converted[2]))
    if kind in FORMATS:
        return bits_of(kind, of_floats(operation, converted))
    if operation in ("/", "%") and converted[1] != 0:
        quotient = abs(converted[0]) // abs(converted[1]) * (1 if (converted[0] < 0) == (converted[1] < 0) else -1)
        return bits_of(kind, quotient if operation == "/" else converted[0] - converted[1] * quotient)
    if operation not in INTEGERS:
        raise Undefined
    return bits_of(kind, INTEGERS[operation](*converted))


def exact(operation, operands, result):
    """Returns the only right value, which has the type of `result`, or None if several are allowed or the operation is unknown."""
    count = len(result.lanes)
    try:
        if operation.startswith("as_"):
            data = b"".join(bits.to_bytes(BITS[operands[0].type] // 8, "little") for bits in operands[0].lanes)
            size = BITS[result.type] // 8
            return Value(result.type, tuple(int.from_bytes(data[at:at + size], "little") for at in range(0, len(data), size)))
        lanes = []
        for lane in range(count):
            of = [(operand.type, operand.lanes[lane if len(operand.lanes) > 1 else 0]) for operand in operands]
            if re.search(r"_(rt[ezpn]|sat)\b|_sat_", operation):
                raise Undefined  # kernels do not use them
            if operation == "select":
                is_true = number(*of[0]) < 0 if len(operands[0].lanes) > 1 else of[0][1] != 0
                of, name = [of[1 if is_true else 2]], "convert"
            else:
                name = re.sub(r"^convert_\w+$", "convert", operation)
            bits = of_lane(name, result.type, of)
            lanes.append((1 << BITS[result.type]) - 1 if bits is True and count > 1 else int(bits))
        return Value(result.type, tuple(lanes))
    except (Undefined, IndexError, TypeError):
        return None
