#!/usr/bin/env python3
"""Provokes every fault listed in docs/design/testing.md in a running daemon. Prints a Markdown
table of the fault, the number of tries and the result. Linux only.

Usage: faults.py [--program=build/release/windsplat] [--quick] [--count=N] [--only=PART]...
       [--list] [--require-all] [--slack=1]

--quick tries each fault a few times; --count sets the number of tries for all; --only selects
cases by a part of their name; --slack is a factor for the time limits of an idle machine. A
missing tool or permission is reported with the cases it prevents: those rows say NOT TRIED, and
with --require-all they are failures. Exit code 0: every case that was tried passed."""
import argparse
import pathlib
import sys
import tempfile
import time
import traceback

sys.path.insert(0, str(pathlib.Path(__file__).parent))
# Importing these modules registers their cases, in the order of the table.
import cases_http  # noqa: E402, F401
import cases_stream  # noqa: E402, F401
import cases_access  # noqa: E402, F401
import cases_view  # noqa: E402, F401
import cases_data  # noqa: E402, F401
import cases_system  # noqa: E402, F401
import cases_life  # noqa: E402, F401
from support import CASES, Failed, Untried, World, check_good  # noqa: E402


def run_case(world, one, count):
    """Runs a case; returns the result and the verdict."""
    try:
        outcome = one.call(world, count)
        daemon = world.daemon()
        check_good(daemon.port)
        return outcome, "ok"
    except Untried as why:
        return str(why), "NOT TRIED"
    except Failed as fault:
        return str(fault), "FAILED"
    except Exception:  # an error of the script, or an unexpected one
        return " / ".join(traceback.format_exc().strip().splitlines()[-3:]), "FAILED"
    finally:
        world.end_case()


def cell(text):
    return "".join(c if c.isprintable() else "?" for c in text).replace("|", "\\|")


def run(options, world):
    chosen = [c for c in CASES
              if not options.only or any(part in c.name for part in options.only)]
    if not chosen:
        sys.exit("faults.py: unknown case; --list prints the names")
    print("| fault | tries | result | |\n|---|---|---|---|", flush=True)
    verdicts = []
    for one in chosen:
        count = options.count or (one.quick if options.quick else one.count)
        since = time.monotonic()
        before = world.shared
        outcome, verdict = run_case(world, one, count)
        if before is not None and not before.alive():
            outcome, verdict = f"the daemon exited ({before.child.returncode}); {outcome}", "FAILED"
        verdicts.append(verdict)
        tried = "-" if verdict == "NOT TRIED" else str(count)
        print(f"| {one.name} | {tried} | {cell(outcome)} | {verdict} |", flush=True)
        print(f"{one.name}: {time.monotonic() - since:.1f} s", file=sys.stderr)
    return verdicts


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    default = pathlib.Path(__file__).resolve().parents[2] / "build/release/windsplat"
    parser.add_argument("--program", default=str(default))
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--count", type=int)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--slack", type=float, default=1, help="factor for time limits")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--require-all", action="store_true")
    options = parser.parse_args()
    if options.list:
        print("\n".join(f"{c.name} ({c.count}, quick {c.quick})" for c in CASES))
        return 0
    with tempfile.TemporaryDirectory(prefix="windsplat-faults-") as folder:
        world = World(options.program, pathlib.Path(folder).resolve(), options.quick,
                      options.slack)
        verdicts = run(options, world)
        code = world.end()
    untried, failed = verdicts.count("NOT TRIED"), verdicts.count("FAILED")
    print(f"\n{len(verdicts)} faults: {len(verdicts) - untried - failed} ok, {failed} failed, "
          f"{untried} not tried; the daemon that went through them ended with {code}")
    return 1 if failed or code != 0 or (untried and options.require_all) else 0


if __name__ == "__main__":
    sys.exit(main())
