"""Every benchmark in turn: `python -m tests.bench`, or `python -m tests.bench vision` for some."""

from __future__ import annotations

import importlib
import pkgutil
import sys

import tests.bench


def main(wanted: list[str]) -> None:
    """Run the benchmarks whose names are wanted, or all."""
    names = sorted(
        module.name.removeprefix("bench_")
        for module in pkgutil.iter_modules(tests.bench.__path__)
        if module.name.startswith("bench_")
    )
    unknown = sorted(set(wanted) - set(names))
    if unknown:
        sys.exit(f"no such benchmark: {', '.join(unknown)}; there are: {', '.join(names)}")
    for name in wanted or names:
        print(f"\n== {name}")
        importlib.import_module(f"tests.bench.bench_{name}").main()


main(sys.argv[1:])
