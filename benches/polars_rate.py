"""Time in which polars reads columns of Parquet files, and their size in memory: seconds, MB.

    python3 benches/polars_rate.py COLUMN,COLUMN,... FILE...

The best of three after a run that fills the file cache. Needs polars.
"""

import sys
import time

import polars


def read(columns, files):
    size = 0
    for path in files:
        there = polars.read_parquet_schema(path)
        frame = polars.read_parquet(path, columns=[c for c in columns if c in there])
        size += frame.height * frame.width * 8
    return size


def main():
    columns, files = sys.argv[1].split(","), sys.argv[2:]
    read(columns, files)
    best = float("inf")
    for _ in range(3):
        start = time.perf_counter()
        size = read(columns, files)
        best = min(best, time.perf_counter() - start)
    print(best, size / 1e6)


main()
