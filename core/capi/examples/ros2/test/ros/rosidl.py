"""Writes the messages' C++ headers with ROS 2's own generator, as Debian packages it: rosidl.py MESSAGES OUT

Needs `apt-get install python3-rosidl rosidl-generator-c-cpp librosidl-runtime-c-cpp-dev`. Prints the
folders to include.
"""

import json
import os
import sys
from contextlib import redirect_stdout
from pathlib import Path

PREFIX = Path(os.environ.get("ROSIDL_PREFIX", "/usr"))
sys.path.append(str(PREFIX / "lib/python3/dist-packages"))

from rosidl_adapter.msg import convert_msg_to_idl  # noqa: E402
from rosidl_generator_cpp import generate_cpp  # noqa: E402


def packages_of(messages):
    """The lines of each message, by package and name."""
    packages, lines = {}, []
    for line in (line.split("#")[0].strip() for line in Path(messages).read_text().splitlines()):
        if "/" in line and " " not in line:
            package, name = line.split("/")
            lines = packages.setdefault(package, {}).setdefault(name, [])
        elif line:
            lines.append(line)
    return packages


def generate(package, messages, out):
    source = out / "source" / package
    (source / "msg").mkdir(parents=True)
    for name, lines in messages.items():
        (source / "msg" / f"{name}.msg").write_text("\n".join(lines) + "\n")
        convert_msg_to_idl(source, package, Path("msg") / f"{name}.msg", source / "msg")
    arguments = {
        "package_name": package,
        "idl_tuples": [f"{source}:msg/{name}.idl" for name in messages],
        "output_dir": str(out / package),
        "template_dir": str(PREFIX / "share/rosidl_generator_cpp/resource"),
        "ros_interface_dependencies": [],
        "target_dependencies": [],
    }
    (source / "arguments.json").write_text(json.dumps(arguments))
    generate_cpp(str(source / "arguments.json"))


def main(messages, out):
    out = Path(out).absolute()
    with redirect_stdout(sys.stderr):
        for package, lines in packages_of(messages).items():
            generate(package, lines, out)
    runtime = PREFIX / "include"
    folders = [runtime / name for name in ("rosidl_runtime_cpp", "rosidl_runtime_c", "rosidl_typesupport_interface", "rcutils")]
    print(*[f"-I{folder}" for folder in (out, *folders, runtime)])


if __name__ == "__main__":
    main(*sys.argv[1:])
