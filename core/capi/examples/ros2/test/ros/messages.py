"""Writes C++ headers of ROS 2's messages, so that the node compiles where no ROS is: messages.py MESSAGES OUT

MESSAGES is messages.txt. The names of headers, types and fields are those that ROS's own generator gives.
"""

import re
import sys
from pathlib import Path

TYPES = {"bool": "bool", "byte": "unsigned char", "string": "std::string", "float32": "float", "float64": "double"}
TYPES |= {f"{sign}int{bits}": f"{sign}int{bits}_t" for sign in ("", "u") for bits in (8, 16, 32, 64)}


def snake(name):
    """`Detection3DArray` is in `detection3_d_array.hpp`."""
    return re.sub("([a-z0-9])([A-Z])", r"\1_\2", re.sub("(.)([A-Z][a-z]+)", r"\1_\2", name)).lower()


def header_of(message):
    package, name = message.split("/")
    return f"{package}/msg/{snake(name)}.hpp"


def member(line):
    """A field or a constant as C++, and the message that its type is, or None."""
    kind, rest = line.split(" ", 1)
    if constant := re.fullmatch(r"(\w+)=(\S+)", rest):
        return f"static constexpr {TYPES[kind]} {constant[1]} = {constant[2]};", None
    name, *default = rest.split()
    kind, array = re.fullmatch(r"([\w/]+)(\[\d*\])?", kind).groups()
    needs = kind if "/" in kind else None
    cpp = "{}::msg::{}".format(*kind.split("/")) if needs else TYPES[kind]
    if array:
        cpp = f"std::vector<{cpp}>" if array == "[]" else f"std::array<{cpp}, {array[1:-1]}>"
    return f"{cpp} {name}{{{''.join(default)}}};", needs


def write(message, lines, out):
    package, name = message.split("/")
    members = [member(line) for line in lines]
    includes = sorted({header_of(needs) for _, needs in members if needs})
    text = ["#pragma once", "#include <array>", "#include <cstdint>", "#include <memory>", "#include <string>", "#include <vector>"]
    text += [f"#include <{include}>" for include in includes]
    text += [f"namespace {package}::msg {{", f"struct {name} {{", *(f"  {declaration}" for declaration, _ in members)]
    text += [f"  using SharedPtr = std::shared_ptr<{name}>;", f"  using ConstSharedPtr = std::shared_ptr<const {name}>;"]
    text += ["};", f"}}  // namespace {package}::msg", ""]
    path = out / header_of(message)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(text))


def main(messages, out):
    current, lines = None, []
    for line in [line.split("#")[0].strip() for line in Path(messages).read_text().splitlines()] + ["end/end"]:
        if "/" in line and " " not in line:
            if current:
                write(current, lines, Path(out))
            current, lines = line, []
        elif line:
            lines.append(line)


if __name__ == "__main__":
    main(*sys.argv[1:])
