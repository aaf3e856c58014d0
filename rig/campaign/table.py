"""The campaign's table, as files for machines (CSV, JSON) and for people (Markdown)."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path

from rig.campaign.judge import PRESSURE_MARGIN, Verdict

COLUMNS = (
    "scenario",
    "description",
    "requirements",
    "seed",
    "injected_s",
    "code",
    "detected_after_s",
    "valve_open_after_s",
    "bound_s",
    "vented_after_s",
    "peak_kpa",
    "peak_bound_kpa",
    "final",
    "final_kpa",
    "run",
    "reason",
    "points",
    "wrong_points",
    "log",
    "verdict",
    "complaints",
)

Row = dict[str, str | float | int | None]


def row(verdict: Verdict) -> Row:
    """One line of the table; times in seconds, pressures in kPa, None where there is nothing."""
    outcome = verdict.outcome
    script = outcome.script
    return {
        "scenario": script.name,
        "description": script.description,
        "requirements": " ".join(script.requirements),
        "seed": outcome.seed,
        "injected_s": _rounded(outcome.injected_s),
        "code": outcome.code,
        "detected_after_s": _rounded(outcome.detected_s),
        "valve_open_after_s": _rounded(outcome.valve_s),
        "bound_s": script.expect.within,
        "vented_after_s": _rounded(outcome.vented_s),
        "peak_kpa": _rounded(outcome.peak_kpa),
        "peak_bound_kpa": _rounded(PRESSURE_MARGIN * outcome.limit_kpa),
        "final": outcome.actuator,
        "final_kpa": _rounded(outcome.final_kpa),
        "run": outcome.run,
        "reason": outcome.reason,
        "points": len(outcome.points),
        "wrong_points": verdict.wrong_points,
        "log": outcome.log_problem or ("none" if outcome.run == "refused" else "sound"),
        "verdict": "pass" if verdict.passed else "FAIL",
        "complaints": "; ".join(verdict.complaints),
    }


def write_tables(folder: Path, verdicts: Sequence[Verdict], bench: str) -> list[Path]:
    """Write `campaign.csv`, `.json` and `.md` into `folder`, made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = [row(v) for v in verdicts]
    texts = {
        "campaign.csv": _csv(rows),
        "campaign.json": json.dumps(
            {"bench": bench, "passed": all(v.passed for v in verdicts), "scenarios": rows}, indent=2
        )
        + "\n",
        "campaign.md": _markdown(rows, bench),
    }
    paths = []
    for name, text in texts.items():
        path = folder / name
        path.write_text(text, encoding="utf-8")
        paths.append(path)
    return paths


def seconds(value: str | float | int | None) -> str:
    """`12 ms` or `1.24 s`; a dash for nothing."""
    if not isinstance(value, int | float):
        return "-"
    return f"{value * 1000:.0f} ms" if value < 1 else f"{value:.2f} s"


def _rounded(value: float | None) -> float | None:
    # what lies below a millisecond or a pascal is round-off; -0.0 would differ from 0.0 in print
    return None if value is None else round(value, 3) + 0.0


def _csv(rows: Sequence[Row]) -> str:
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def _markdown(rows: Sequence[Row], bench: str) -> str:
    passed = sum(r["verdict"] == "pass" for r in rows)
    lines = [
        f"# Fault campaign on the bench '{bench}'",
        "",
        f"{passed} of {len(rows)} scenarios passed. Times count from the first fault.",
        "",
        "| scenario | what happens | requirements | code | detected | valve open | bound | vented "
        "| peak (kPa) | end | run | points | wrong | log | verdict |",
        "| --- " * 15 + "|",
    ]
    for r in rows:
        cells = [
            r["scenario"],
            r["description"],
            r["requirements"],
            r["code"],
            seconds(r["detected_after_s"]),
            seconds(r["valve_open_after_s"]),
            seconds(r["bound_s"]),
            seconds(r["vented_after_s"]),
            f"{r['peak_kpa']:.2f}",
            r["final"],
            r["run"],
            r["points"],
            r["wrong_points"],
            r["log"],
            f"{r['verdict']} {r['complaints']}".strip(),
        ]
        lines.append("| " + " | ".join(str(c).replace("|", "/") for c in cells) + " |")
    return "\n".join(lines) + "\n"
