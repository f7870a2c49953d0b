#!/usr/bin/env python3
"""Proofs from a firmware's machine code: proofs.py ELF --stack FUNCTION=BYTES... [--allow FILE]

The first FUNCTION is the root: its name, or the end of the part of its path before type parameters. Fails, and says why, when from there
- a panic can be reached that the allow-list does not name,
- a function can reach itself, or a call goes through a pointer the allow-list does not resolve,
- the worst path through the call graph takes more stack than allowed, from any FUNCTION.

Frames are the compiler's own figures (-Zemit-stack-sizes), calls are read from the disassembly of a Thumb program, places from its
line tables. The allow-list has a line per entry, `KIND PATTERN # reason`; an entry that nothing matches is an error as well:
  panic PATTERN             a place (file:line or function) that calls a panicking function, as a regular expression
  pointer CALLER CALLEE     a call through a pointer, and every function it can go to, as regular expressions
"""

import argparse
import collections
import pathlib
import re
import subprocess
import sys
import tempfile

# Where core's panics begin. Every other caller of the panic handler is listed by itself.
PANICKING = re.compile(r"\bpanicking::|::(expect|unwrap|len_mismatch|slice_\w+)_failed?\b|::slice_index_fail\b|::len_mismatch_fail\b|handle_alloc_error|capacity_overflow|panic_const|::panic_\w+$")
HANDLER = re.compile(r"rust_begin_unwind$")
CALL = re.compile(r"^(bl|blx|b|b[a-z]{2})(\.w|\.n)?$")


def run(*command, text=None):
    return subprocess.run(command, capture_output=True, text=True, check=True, input=text).stdout


def demangle(names):
    """Rust's names as paths, without the crates' hashes."""
    out = run("llvm-cxxfilt", text="\n".join(names)).splitlines()
    return {name: re.sub(r"\[[0-9a-f]+\]", "", nice) for name, nice in zip(names, out)}


class Program:
    def __init__(self, elf):
        self.elf = elf
        self.at = {}
        for line in run("llvm-nm", elf).splitlines():
            address, kind, symbol = (line.split() + ["", ""])[:3]
            if kind in "tTwW" and kind and not symbol.startswith("$"):
                self.at.setdefault(int(address, 16) & ~1, symbol)
        self.nice = demangle(sorted(set(self.at.values())))
        self.frame = self.frames()
        self.calls = collections.defaultdict(list)  # function -> [(address, callee)]
        self.pointers = collections.defaultdict(list)  # function -> [address]
        self.read()

    def frames(self):
        """Bytes of each function's frame: the section holds an address and a LEB128 number per function."""
        frames, at = {}, 0
        with tempfile.TemporaryDirectory() as folder:
            run("llvm-objcopy", f"--dump-section=.stack_sizes={folder}/sizes", self.elf, "/dev/null")
            data = pathlib.Path(folder, "sizes").read_bytes()
        while at + 4 < len(data):
            address, at, size, shift = int.from_bytes(data[at : at + 4], "little"), at + 4, 0, 0
            while True:
                byte, at = data[at], at + 1
                size, shift = size | (byte & 0x7F) << shift, shift + 7
                if byte < 0x80:
                    break
            if symbol := self.at.get(address & ~1):
                frames[symbol] = max(frames.get(symbol, 0), size)
        return frames

    def read(self):
        """Who calls whom."""
        function = None
        for line in run("llvm-objdump", "-d", "--no-show-raw-insn", self.elf).splitlines():
            if match := re.match(r"^([0-9a-f]+) <(.*)>:$", line):
                function = self.at.get(int(match[1], 16), function)
                continue
            match = re.match(r"^\s*([0-9a-f]+):\s+(\S+)\s*(.*)$", line)
            if not match or function is None:
                continue
            address, operation, operands = int(match[1], 16), match[2], match[3]
            target = re.search(r"0x([0-9a-f]+) <", operands)
            if CALL.match(operation) and target:
                callee = self.at.get(int(target[1], 16) & ~1)
                # A branch within a function is not a call; a branch with link always is.
                if callee and (callee != function or operation in ("bl", "blx", "bl.w")):
                    self.calls[function].append((address, callee))
            elif operation == "blx" or operation == "bx" and operands.strip() != "lr" or re.match(r"pc,", operands):
                self.pointers[function].append(address)

    def places(self, addresses):
        """For each address the innermost place in code that is not the language's own library, as `file:line`."""
        if not addresses:
            return {}
        text = "\n".join(hex(address) for address in addresses)
        blocks = run("llvm-symbolizer", "--inlining", "--functions=none", "--obj=" + self.elf, text=text).strip().split("\n\n")
        places = {}
        for address, block in zip(addresses, blocks):
            frames = [line.rsplit(":", 1)[0] for line in block.splitlines()]
            own = [frame for frame in frames if not re.search(r"rustlib/src|/library/|/registry/|^\?\?", frame)]
            places[address] = re.sub(r"^.*/((core|fixtures|tests)/)", r"\1", (own or frames)[0])
        return places


def allowed(path):
    entries = []
    for line in open(path, encoding="utf-8") if path else []:
        fields = line.split("#")[0].split()
        if fields:
            if not line.partition("#")[2].strip():
                sys.exit(f"{path}: no reason given: {line.strip()}")
            entries.append([fields[0], [re.compile(field) for field in fields[1:]], 0])
    return entries


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("elf")
    arguments.add_argument("--stack", action="append", required=True)
    arguments.add_argument("--allow")
    options = arguments.parse_args()
    program, allow, failures = Program(options.elf), allowed(options.allow), []
    nice = program.nice

    # Calls through pointers become calls to what the allow-list says they reach.
    for function, addresses in program.pointers.items():
        entry = next((entry for entry in allow if entry[0] == "pointer" and entry[1][0].search(nice[function])), None)
        if entry:
            entry[2] += 1
            callees = [name for name in nice if any(pattern.search(nice[name]) for pattern in entry[1][1:])]
            program.calls[function] += [(address, callee) for address in addresses for callee in callees]
            addresses.clear()

    # What the root reaches.
    limits = []
    for name, _, limit in (limit.rpartition("=") for limit in options.stack):
        roots = [symbol for symbol in nice if nice[symbol] == name or re.sub(r"::<.*", "", nice[symbol].replace("<dyn", "<")).endswith(name)]
        if not roots:
            sys.exit(f"no function {name}")
        limits += [(name, symbol, int(limit)) for symbol in roots]
    root = limits[0][1]
    reached, todo = {root}, [root]
    while todo:
        for _, callee in program.calls[todo.pop()]:
            if callee not in reached:
                reached.add(callee)
                todo.append(callee)

    # Panics: calls from elsewhere into core's panicking functions or straight to the handler.
    panicking = {name for name in reached if PANICKING.search(nice[name]) or HANDLER.search(nice[name])}
    sites = [(a, f, c) for f in sorted(reached - panicking) for a, c in program.calls[f] if c in panicking]
    places = program.places([address for address, _, _ in sites])
    listed = collections.Counter()
    for address, function, callee in sites:
        entry = next((e for e in allow if e[0] == "panic" and (e[1][0].search(places[address]) or e[1][0].search(nice[function]))), None)
        if entry:
            entry[2] += 1
        else:
            listed[(places[address], nice[function].split("::<")[0][-60:], nice[callee].rsplit("::", 1)[-1])] += 1
    for (place, function, callee), count in sorted(listed.items()):
        print(f"  panic: {place} in {function}: {callee}" + (f" x {count}" if count > 1 else ""))
    print(f"panics that can be reached: {sum(listed.values())} not allowed, {len(sites) - sum(listed.values())} allowed")
    if listed:
        failures.append("a panic can be reached")

    # Stack: the deepest path, without the panics' own.
    unresolved = [nice[f] for f in reached - panicking if program.pointers.get(f)]
    depth, cycles, unknown, path = {}, [], set(), []

    def deepest(function):
        if function in depth:
            return depth[function]
        if function in path:
            cycles.append([nice[f] for f in path[path.index(function):]])
            return (0, [])
        path.append(function)
        below = max((deepest(c) for _, c in program.calls[function] if c not in panicking), default=(0, []), key=lambda d: d[0])
        path.pop()
        frame = program.frame.get(function)
        if frame is None:
            unknown.add(nice[function])
        depth[function] = ((frame or 0) + below[0], [(frame or 0, nice[function])] + below[1])
        return depth[function]

    sys.setrecursionlimit(10_000)
    largest = max(((program.frame.get(f, 0), nice[f]) for f in reached - panicking), default=(0, ""))
    print(f"largest frame: {largest[0]} bytes, {largest[1][:120]}")
    for name, symbol, limit in limits:
        total, way = deepest(symbol)
        print(f"deepest path from {name}: {total} bytes, {limit} allowed")
        for frame, function in way:
            if frame:
                print(f"  {frame:6} {function[:120]}")
        if total > limit:
            failures.append(f"the stack can take {total} bytes from {name}")
    if unknown:
        print(f"without a frame on file, counted as 0: {', '.join(sorted(unknown))}")
    for cycle in cycles:
        print("  recursion: " + " -> ".join(f[:100] for f in cycle))
    for function in sorted(unresolved):
        print(f"  call through a pointer: {function[:160]}")
    print(f"recursions: {len(cycles)}, calls through unresolved pointers: {len(unresolved)}")
    if cycles:
        failures.append("a function can reach itself")
    if unresolved:
        failures.append("a call goes through a pointer")
    failures += [f"allow-list: nothing matches {e[0]} {' '.join(p.pattern for p in e[1])}" for e in allow if not e[2]]
    for failure in failures:
        print(f"FAILED: {failure}")
    sys.exit(bool(failures))


main()
