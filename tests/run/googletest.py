"""The test cases of a GoogleTest program: parses its output and runs selected cases."""
import os
import re
import subprocess

BEGUN = re.compile(r"\[ RUN      \] (\S+)")
ENDED = re.compile(r"\[ +(OK|SKIPPED|FAILED) +\] \S+?(?:,.*)? \((\d+) ms\)$")


def cases(text):
    """name -> (result, seconds, output); a result is ok, skipped, failed or crashed (started
    without end). Empty for a program without GoogleTest."""
    found, name = {}, None
    for line in text.splitlines():
        if begun := BEGUN.search(line):
            name = begun[1]
            found[name] = ["crashed", 0.0, []]
        elif name:
            found[name][2].append(line)
            if ended := ENDED.search(line):
                found[name][:2] = ended[1].lower(), int(ended[2]) / 1000
                name = None
    return {name: (result, seconds, "\n".join(said))
            for name, (result, seconds, said) in found.items()}


def run(command, environment, folder, timeout_s=900):
    """The output of the program, until its end or the timeout."""
    try:
        done = subprocess.run(command, env=os.environ | environment, cwd=folder, check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout_s)
        return done.stdout.decode(errors="replace")
    except subprocess.TimeoutExpired as late:
        return (late.stdout or b"").decode(errors="replace") + f"\nended after {timeout_s} s"


def without_shards(environment):
    return {name: value for name, value in environment.items() if "_SHARD" not in name}


def shard(command, environment, folder):
    """The names of an entry's cases: each shard has every n-th one, without disabled cases."""
    suite, names = "", []
    listing = run([*command, "--gtest_list_tests"], without_shards(environment), folder)
    for line in listing.splitlines():
        word = line.split("#")[0].strip()
        if not line.startswith(" "):
            suite = word
        elif "DISABLED_" not in suite + word:
            names.append(suite + word)
    index, count = (int(environment[f"GTEST_{word}"]) for word in ("SHARD_INDEX", "TOTAL_SHARDS"))
    return names[index::count]


def run_cases(command, environment, folder, names):
    """As cases(), of the named ones; after a crash the remaining ones still run."""
    found, left = {}, list(names)
    while left:
        chosen = without_shards(environment) | {"GTEST_FILTER": ":".join(left)}
        said = run(command, chosen, folder)
        begun = cases(said) or {name: ("crashed", 0.0, said) for name in left}
        found |= begun
        left = [name for name in left if name not in begun]
    return found
