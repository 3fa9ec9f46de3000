#!/usr/bin/env python3
"""The deepest stack of each blik_* function, summed over the calls in the machine code for 32-bit ARM (Thumb).

    .ci/stack.py LIBRARY [--limit BYTES] [--paths] [--tools PREFIX]

LIBRARY is the archive of one object that ffi/single_object.sh makes. A function's frame is all that its instructions take
from the stack pointer; its calls are the relocations of its branches and, for calls by address, what RULES say. Errors
are recursion, a change of the stack pointer of unknown size, a call by address that no rule explains, a function whose
address is taken and which no rule names, and a function that takes more than the limit. Not counted is what functions of
the program take: callbacks, memcpy, memmove, memset, memcmp.
"""

import argparse
import re
import subprocess
import sys
from collections import defaultdict

# Functions that call by address, and the functions that they may call so: patterns of names. Of the latter count those
# whose address was taken by the nearest caller that took any of them; where none did, all. "": callbacks alone.
RULES = [
    # stages of the C interface: the caller's threads take a lane, a lane its items
    (r"^blik::run::Runner::each$", r"^blik::run::lane$"),
    (
        r"^blik::run::Job::lane$",
        r"^(<blik::run::Runner as blik_kernel::stages::Executor>::pieces|"
        r"blik::(plane::Lanes::rows|plane::solution::fill_direct|lights::solve_all|view::(follow|paint)))::\{\{closure\}\}$",
    ),
    (r"^blik::plane::Lanes::rows::", r"^blik::plane::(coupling::build|solution::build|view::trace)::\{\{closure\}\}$"),
    (r"^blik::plane::view::trace::", r"^blik::plane::view::blik_plane_(image|radiance)::"),
    # a mesh and a tracer of the caller's
    (
        r"^blik_kernel::scene::",
        r"^<(blik::mesh::Reader|blik_kernel::scene::pose::PosedMesh<M>) as blik_kernel::scene::input::Mesh>::",
    ),
    (
        r"^blik_kernel::rays::bvh::external::",
        r"^<blik::intersector::Caller as blik_kernel::rays::bvh::external::Intersector>::",
    ),
    (r"^<?blik::intersector::Caller\b", ""),
    # a function of progress
    (r"^(blik::explain::blik_explain::|blik_kernel::stages::lights::explain_view$)", ""),
    # rays of a series, and who traces them
    (
        r"^blik_kernel::rays::bvh::external::\w+::answer$",
        r"^blik_kernel::(rays::bvh::external::<impl blik_kernel::rays::bvh::Bvh>::(closest|occluded)_of|"
        r"view::image::Painter::(first_hit|scatter)|view::signature::Tracer::sample|coupling::subdivide::Probe::shoot)::\{\{closure\}\}$|^blik::scene::blik_any_hits::",
    ),
    # an image's rows are integrals of integrals
    (r"^blik_kernel::view::image::line_integral::(integrate|put)$", r"^blik_kernel::view::image::Painter::lines_across::"),
    # skies of the plane model, the caller's among them
    (r"^<?blik_kernel::plane::", r"^blik::plane::solution::(asking|DARK)\b"),
    (r"^blik::plane::solution::asking::", ""),
]
# Never called by address: entries of tables for closures that are consumed, which nobody does.
UNUSED = r"FnOnce::call_once\{\{vtable\.shim\}\}"
OUTSIDE = {"memcpy", "memmove", "memset", "memcmp"}

HEADER = re.compile(r"[0-9a-f]+ <(.+)>:$")
INSTRUCTION = re.compile(r"\s+[0-9a-f]+:\t(\S+)(?:\t(.*))?$")
RELOCATION = re.compile(r"\s*[0-9a-f]+:? (R_ARM_\S+)\s+(\S+)$")
RECORDS = re.compile(r"RELOCATION RECORDS FOR \[(.+)\]:$")
SYMBOL = re.compile(r"([0-9a-f]{8}) .{7} (\S+)\t[0-9a-f]+ (?:\.hidden )?(\S+)$")


class Function:
    def __init__(self, name):
        self.name = name
        self.frame = 0
        self.calls = {}  # name (None: by address) to whether it stands on this function's frame or takes its place
        self.taken = set()


def registers(text):
    """Bytes of a list such as {r4, r8-r11, lr} or {d8-d11}."""
    total = 0
    for item in text.split(","):
        ends = re.findall(r"\d+", item)
        count = int(ends[1]) - int(ends[0]) + 1 if len(ends) == 2 else 1
        total += count * (8 if "d" in item else 4)
    return total


def taken_from_stack(name, arguments, copies):
    """Bytes by which an instruction moves the stack pointer down; 0 where it moves it up or not at all."""
    parts = [part.strip() for part in arguments.split("@")[0].split(",")]
    amounts = [int(amount) for amount in re.findall(r"#(-?\d+)", arguments.split("@")[0])]
    target, is_sum = parts[0], re.fullmatch(r"(add|sub)[w.]*", name)
    if name.startswith(("push", "vpush")) or re.match(r"v?stmdb", name) and target == "sp!":
        return registers(re.search(r"\{(.*)\}", arguments)[1])
    if "[sp, #" in arguments and parts[-1].endswith("]!"):
        return max(0, -amounts[-1])
    if name == "mov" and parts[1:] == ["sp"]:
        copies.add(target)
    elif name == "bfc" and target in copies:
        # rounded down; the ABI keeps multiples of 8
        return max(0, (1 << amounts[1]) - 8)
    elif target == "sp" and is_sum and amounts:
        return amounts[-1] if name.startswith("sub") else 0
    elif target == "sp" and not re.match(r"v?(st|ld)m", name) and not (name == "mov" and parts[1] in copies):
        sys.exit(f"not understood: {name} {arguments}")
    return 0


class Library:
    def __init__(self, path, tools):
        def run(*command, **more):
            return subprocess.run(command, check=True, capture_output=True, text=True, **more).stdout

        self.functions = {}
        self.read_code(run(tools + "objdump", "-dr", "--no-show-raw-insn", path))
        self.read_addresses(run(tools + "objdump", "-rt", path))
        plain = run(tools + "c++filt", input="\n".join(self.functions)).splitlines()
        self.plain = {name: re.sub(r"::h[0-9a-f]{16}$", "", text) for name, text in zip(self.functions, plain)}

    def read_code(self, listing):
        function, waiting, copies = None, None, set()
        for line in [*listing.splitlines(), ""]:
            relocation = RELOCATION.match(line)
            if relocation and function:
                kind, target = relocation.groups()
                if waiting and ("CALL" in kind or "JUMP" in kind):
                    self.call(function, target, waiting)
                    waiting = None
                elif "MOVW" in kind or "ABS32" in kind or "REL32" in kind:
                    function.taken.add(target)
                continue
            if waiting and re.match(r"blx?(?!\w)", waiting[0]):
                # no relocation: within the section
                self.call(function, re.search(r"<(.+)>", waiting[1])[1], waiting)
            waiting = None
            if header := HEADER.match(line):
                function = self.functions[header[1]] = Function(header[1])
                copies = set()
            elif (instruction := INSTRUCTION.match(line)) and function:
                name, arguments = instruction[1], instruction[2] or ""
                if re.fullmatch(r"blx?\w*", name) and re.fullmatch(r"r\d+|ip|lr|sl|fp|sb", arguments):
                    self.call(function, None, (name, arguments))
                elif re.fullmatch(r"bx\w*", name) and arguments != "lr":
                    self.call(function, None, (name, arguments))
                elif name[0] == "b" and "<" in arguments:
                    waiting = (name, arguments)
                else:
                    function.frame += taken_from_stack(name, arguments, copies)

    @staticmethod
    def call(function, target, instruction):
        stands = re.match(r"blx?(?:$|..$)", instruction[0]) is not None
        function.calls[target] = function.calls.get(target, False) or stands

    def read_addresses(self, listing):
        """Other names of functions, and the functions whose address is taken, directly or by way of tables."""
        places, inside, section = {}, defaultdict(set), None
        for line in listing.splitlines():
            if symbol := SYMBOL.match(line):
                places[symbol[3]] = (symbol[2], int(symbol[1], 16) & ~1)
            elif records := RECORDS.match(line):
                section = records[1]
            elif (relocation := RELOCATION.match(line)) and section and ".text" not in section:
                inside[section].add(relocation[2])
        own = {places[name]: name for name in self.functions}
        self.names = {name: own[place] for name, place in places.items() if place in own}
        for function in self.functions.values():
            seen, left, code = set(), [name for name in function.taken], set()
            while left:
                name = left.pop()
                if name in self.names:
                    code.add(self.names[name])
                    continue
                table = places.get(name, (name,))[0]
                if table not in seen:
                    seen.add(table)
                    left.extend(inside[table])
            function.taken = frozenset(code)
            function.calls = {self.names.get(name, name): stands for name, stands in function.calls.items()}


class Depths:
    """Deepest stacks, each with its way. `nearest`: per rule, the functions that the nearest caller took."""

    def __init__(self, library):
        self.library = library
        self.known = {}
        self.used = set()
        self.circles = set()
        taken = {name for function in library.functions.values() for name in function.taken}
        self.all = [frozenset(n for n in taken if b and re.search(b, library.plain[n])) for _, b in RULES]
        named = frozenset().union(*self.all)
        rest = [library.plain[n] for n in taken - named if not re.search(UNUSED, library.plain[n])]
        if rest:
            sys.exit("addresses taken that no rule names:\n  " + "\n  ".join(sorted(rest)))

    def of(self, name, nearest, way=()):
        """(bytes, names from here down)."""
        if name in OUTSIDE or name not in self.library.functions:
            if name not in OUTSIDE:
                sys.exit(f"undefined: {name}")
            return 0, ()
        key = (name, nearest)
        if key in self.known:
            return self.known[key]
        if key in way:
            self.circles.add(tuple(self.library.plain[n] for n, _ in way[way.index(key) :]))
            return 0, ()
        function = self.library.functions[name]
        inner = tuple(function.taken & all_ or near for all_, near in zip(self.all, nearest))
        best, deepest = function.frame, ()
        for target, stands in function.calls.items():
            for callee in [target] if target else self.called(name, nearest):
                size, names = self.of(callee, inner, (*way, key))
                if size + stands * function.frame > best:
                    best, deepest = size + stands * function.frame, names
        self.known[key] = best, (name, *deepest)
        return self.known[key]

    def called(self, name, nearest):
        function = self.library.functions[name]
        matching = [i for i, (by, _) in enumerate(RULES) if re.search(by, self.library.plain[name])]
        if not matching:
            sys.exit(f"calls by address, and no rule says what: {self.library.plain[name]}")
        self.used.update(matching)
        return {n for i in matching for n in function.taken & self.all[i] or nearest[i]}


def main():
    arguments = argparse.ArgumentParser(description="Deepest stack of each blik_* function.")
    arguments.add_argument("library")
    arguments.add_argument("--limit", type=int, default=sys.maxsize)
    arguments.add_argument("--paths", action="store_true", help="the functions on the deepest way, with their frames")
    arguments.add_argument("--tools", default="arm-none-eabi-", help="prefix of objdump and c++filt")
    options = arguments.parse_args()
    library = Library(options.library, options.tools)
    depths = Depths(library)
    results = []
    for name in (name for name in library.functions if name.startswith("blik_")):
        results.append((*depths.of(name, tuple(depths.all)), name))
    for size, way, name in sorted(results, reverse=True):
        print(f"{size:6} {name}")
        for step in way if options.paths else ():
            print(f"       {library.functions[step].frame:6} {library.plain[step]}")
    if depths.circles:
        sys.exit("recursion:\n" + "\n".join("  " + " > ".join(names) for names in sorted(depths.circles)))
    for unused in set(range(len(RULES))) - depths.used:
        sys.exit(f"a rule that is of no use: {RULES[unused][0]}")
    if max(results)[0] > options.limit:
        sys.exit(f"more than {options.limit} bytes")


if __name__ == "__main__":
    main()
