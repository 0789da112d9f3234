#!/usr/bin/env python3
"""Checks that the built program has the hardening of cmake/hardening.cmake: position-independent,
stack protection, relocations read-only and bound at start, no executable stack, fortified calls, no
writable library search path. Shadow stacks (-fcf-protection) are not checked: one object without
the mark disables them for the program, and Debian 12's start files lack it.

Usage: check_hardening.py PROGRAM      uses readelf, and checksec if it is installed
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys


def read(program, *options):
    return subprocess.run(["readelf", "-W", *options, program], text=True, capture_output=True,
                          check=True).stdout


def segments(program):
    """Flags of the program's segments by name: {"GNU_STACK": {"RW"}}."""
    out = {}
    row = re.compile(r"^\s+([A-Z_0-9]+)" + r"\s+0x\S+" * 5 + r"\s+([RWE ]{3})", re.M)
    for name, flags in row.findall(read(program, "-l")):
        out.setdefault(name, set()).add(flags.replace(" ", ""))
    return out


def by_readelf(program):
    """Complaints, each a sentence."""
    header, dynamic = read(program, "-h"), read(program, "-d")
    symbols = read(program, "--dyn-syms")
    parts = segments(program)
    out = []
    if not re.search(r"Type:\s+DYN", header) or "PIE" not in dynamic:
        out.append("it is not position-independent (-pie)")
    if not re.search(r"BIND_NOW|Flags:.*\bNOW\b", dynamic) or "GNU_RELRO" not in parts:
        out.append("its relocations can be written to (-z relro -z now)")
    if any("E" in flags for flags in parts.get("GNU_STACK", {"E"})):
        out.append("its stack is executable")
    if any({"W", "E"} <= set(flags) for flags in parts.get("LOAD", {"WE"})):
        out.append("a segment can be written and executed")
    if "__stack_chk_fail" not in symbols:
        out.append("no function has stack protection (-fstack-protector-strong)")
    if not re.search(r"__(memcpy|snprintf|read|memset|memmove|poll)_chk", symbols):
        out.append("no call is fortified (-D_FORTIFY_SOURCE)")
    paths = re.findall(r"\((?:RPATH|RUNPATH)\)\s+Library r\w*path: \[(.*)\]", dynamic)
    if any(not folder.startswith("/") for path in paths for folder in path.split(":")):
        out.append("it searches for libraries in a relative folder")
    return out


def by_checksec(program):
    """The protections that checksec (a Debian package) reports as missing."""
    if shutil.which("checksec") is None:
        return None
    text = subprocess.run(["checksec", "--format=json", f"--file={program}"], text=True,
                          capture_output=True, check=False).stdout
    found = next(iter(json.loads(text).values()))
    wanted = {"relro": "full", "canary": "yes", "nx": "yes", "pie": "yes", "fortify_source": "yes"}
    return [f"checksec reports {key} {found.get(key)}" for key, value in wanted.items()
            if found.get(key) != value]


def check(program):
    complaints = by_readelf(program)
    further = by_checksec(program)
    if further is None:
        print("hardening: checksec is not installed; only readelf was used")
    return complaints + (further or [])


def main():
    if len(sys.argv) != 2 or not pathlib.Path(sys.argv[1]).is_file():
        sys.exit(__doc__)
    complaints = check(sys.argv[1])
    for complaint in complaints:
        print(f"hardening: {sys.argv[1]}: {complaint}")
    print(f"hardening: {len(complaints)} complaints")
    sys.exit(1 if complaints else 0)


if __name__ == "__main__":
    main()
