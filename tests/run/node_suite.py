"""Runs test files of node concurrently; a file that fails is repeated by itself at the end."""
import concurrent.futures
import re
import subprocess
import time

from outcome import Outcome

COUNT = re.compile(r"^# (pass|skipped|todo) (\d+)$", re.M)
FAILED = re.compile(r"^ *not ok \d+ - (.*?)(?: # .*)?$")


def failures(text, file):
    """name -> output, of the failed tests of a file; the file itself if none is named."""
    found, name, said = {}, None, []
    for line in text.splitlines():
        if failed := FAILED.match(line):
            name, said = f"{file}: {failed[1]}", []
            found[name] = said
        elif name:
            said.append(line)
            if line.strip() == "...":
                name = None
    return {name: "\n".join(said) for name, said in found.items()} or {file: text[-4000:]}


def run_file(command, file, emit):
    begin = time.monotonic()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          errors="replace", text=True, check=False)
    seconds = time.monotonic() - begin
    text = re.sub(r"\x1b\[[0-9;]*m", "", done.stdout)
    counts = {word: int(number) for word, number in COUNT.findall(text)}
    good = done.returncode == 0
    emit(f"{file}: {'ok' if good else 'FAILED'}, {counts.get('pass', 0)} passed, {seconds:.1f} s\n"
         + ("" if good else text))
    return good, counts, seconds, text


def run(emit, commands, jobs):
    """commands: file -> the arguments that run it."""
    outcome = Outcome()
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        first = list(pool.map(lambda item: run_file(item[1], item[0], emit), commands.items()))
    for (file, command), (good, counts, seconds, text) in zip(commands.items(), first):
        if not good:
            emit(f"{file}, once more by itself\n")
            good, counts, _, again = run_file(command, file, emit)
            (outcome.unstable if good else outcome.failed).update(
                failures(text if good else again, file))
        outcome.passed += counts.get("pass", 0)
        outcome.skipped += counts.get("skipped", 0) + counts.get("todo", 0)
        outcome.durations[file] = seconds
    return outcome
