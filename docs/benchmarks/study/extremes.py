#!/usr/bin/env python3
"""Prints the table of docs/benchmarks/extremes.md from study.json of `windsplat study --extremes`.
Usage: extremes.py STUDY_JSON"""
import json
import sys


def error(value):
    return "" if value is None else f"{value:.1e}"


def rows(trust):
    limits = [f"RMSE <= {one['limit']:g}" for one in trust[0]["within"]]
    yield ["group", "method", "cases", "refused", "failed", "largest RMSE", "at", "measured",
           "measured / true", "within bound", *limits]
    for one in trust:
        least = one["leastReported"]
        yield [one["group"], one["method"], one["cases"], one["refused"], one["failed"],
               error(one["worst"]), one["worstAt"], one["measured"] or "",
               "" if least is None else f"{least:.2f}",
               f"{one['withinBound']} of {one['estimated']}" if one["estimated"] else "",
               *(values["values"] for values in one["within"])]


def main():
    trust = json.load(open(sys.argv[1]))["extremes"]["trust"]
    for n, row in enumerate(rows(trust)):
        print("| " + " | ".join(map(str, row)) + " |")
        if n == 0:
            print("|" + "---|" * len(row))


main()
