"""Writes, reads and judges report.json."""

import heapq
import json
import math
import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from itertools import chain
from pathlib import Path
from typing import Any, Literal

import numpy as np

from parameterize.arrays import in_percent
from parameterize.certificate.jacobian import CLAIMS
from parameterize.files import save_text

from ..level_table import ESTIMATES, EXACT_ERRORS
from ..version import __version__
from .artifacts import REPORT, SOLVED

SCHEMA = 1
MOST_LISTED = 1000  # patches: of more, report.json has the worst
MOST_ROWS, WORST = 40, 10  # patches in a table, and those that are shown of more
SAME_VOLUME = 1e-11  # rounding
DEFECTS = ("unproved", "boundary_meeting", "misglued", "overlap")  # of the section `parameterization`

Report = dict[str, Any]


def versions() -> dict[str, str]:
    """Return the versions of the packages that influence the numbers, without packages that are not installed."""
    found = {"python": platform.python_version()}
    for name in ("numpy", "scipy", "torch"):
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found | {"iga-nn": __version__}


def plain(value: Any) -> Any:
    """Return the same content in JSON's own types: arrays become lists, numbers that are not finite become null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


def as_json(value: Any) -> str:
    """Return the JSON text of a report or a part of it."""
    return json.dumps(plain(value), indent=2, allow_nan=False)


def write(folder: Path, report: Mapping[str, Any]) -> None:
    """Write report.json atomically."""
    save_text(folder / REPORT, as_json(report) + "\n")


def read(folder: Path) -> Report | None:
    """Return the report in a folder; None where no report of this schema is there, or where it is damaged."""
    try:
        report = json.loads((folder / REPORT).read_text(encoding="utf-8"))
        if report["schema"] == SCHEMA and is_finished(report):
            verdict(report, folder)  # it reads all entries that later calls need
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return None
    return report if report["schema"] == SCHEMA else None


def is_finished(report: Report | None) -> bool:
    """Return whether the run that wrote this report has ended, and was not cut short by a time limit."""
    return report is not None and "total" in (report.get("seconds") or {}) and "incomplete" not in report


def is_certified(report: Report) -> bool:
    """Return whether the sign of det J is proved on the whole cube and the boundary was not found to meet itself."""
    section = report["parameterization"]
    return section["bijective"] == "certified" and section.get("boundary_injective") is not False


def claim(report: Report) -> str:
    """Return the claim of a certificate: "det J > 0", of a left-handed volume "det J < 0".

    Of patches of which some are left-handed it is "one sign of det J".
    """
    quality = report["parameterization"]
    hands = summarized(quality)["summary"]["orientations"] if "patches" in quality else [_hand(quality)]
    return CLAIMS[hands[0]] if len(hands) == 1 else "one sign of det J"


def _hand(part: Report) -> str:
    return str(part.get("orientation", "right-handed"))


def summarized(quality: Report) -> Report:
    """Return the section `parameterization` with a summary of several patches.

    Of more than MOST_LISTED patches the section keeps the worst, each with its number, and the first interfaces.
    """
    if "patches" not in quality or "summary" in quality:
        return quality
    parts = quality["patches"]
    summary: Report = {
        "patches": len(parts),
        "interfaces": len(quality.get("interfaces", ())),
        "degrees": sorted({degree for part in parts for degree in part["degrees"]}),
        "orientations": sorted(set(map(_hand, parts))),
    }
    found = quality | {"summary": summary}
    if len(parts) <= MOST_LISTED:
        return found
    return found | {"patches": worst(parts), "interfaces": quality["interfaces"][:WORST]}


def worst(parts: Sequence[Report]) -> list[Report]:
    """Return the WORST patches with their numbers: those that are not certified, or have the least bounds of det J.

    Where distortions were measured, half of them are those of the largest distortion.
    """
    numbered: list[Report] = [{"number": number} | part for number, part in enumerate(parts)]

    def bound(part: Report) -> tuple[bool, float]:
        least = part["det_lower_bound"]
        return part["bijective"] == "certified", -math.inf if least is None else least

    chosen = heapq.nsmallest(WORST, numbered, bound)
    if "arap" in parts[0]:
        largest = heapq.nlargest(WORST, numbered, lambda part: float(part["arap"]["max"]))
        both = chain.from_iterable(zip(chosen, largest, strict=True))
        chosen = list({part["number"]: part for part in both}.values())[:WORST]
    return chosen


def shown_patches(quality: Report) -> list[tuple[str, Report]]:
    """Return the names of several patches with what is known of each: all of them, of many the worst."""
    parts = quality.get("patches", [])
    shown = worst(parts) if len(parts) > MOST_ROWS else parts
    return [(f"p{part.get('number', number)}", part) for number, part in enumerate(shown)]


def patches_heading(quality: Report) -> str:
    """Return the heading of a table of several patches."""
    count = summarized(quality)["summary"]["patches"] if "patches" in quality else 0
    return f"The patches: of {count:,} the {WORST} worst" if count > MOST_ROWS else "The patches"


def size_in_words(quality: Report, sign: str = " × ") -> str:
    """Return the number of control points: of a volume in each direction, of several patches in all."""
    count = quality["control_points"]
    return f"{count:,}" if isinstance(count, int) else sign.join(map(str, count))


def is_converged(report: Report) -> bool:
    """Return whether every solve converged; True where nothing was solved."""
    return all(level["converged"] for level in solved(report).get("levels", []))


def is_meaningful(report: Report) -> bool:
    """Return whether the numbers of the finest solve are meaningful; True where nothing was solved."""
    levels = solved(report).get("levels", [])
    return not levels or levels[-1].get("meaningful", True) is not False


def state(report: Report) -> Literal["certified", "not the part", "not certified", "not solved"]:
    """Return the state of a finished run.

    "not the part" comes first; "not solved" where the numbers of a solve are not to be trusted.
    """
    if not_the_part(report):
        return "not the part"
    if not is_certified(report):
        return "not certified"
    is_missing = "incomplete" in report and "not_solved" in report and not solved(report)
    return "certified" if is_converged(report) and is_meaningful(report) and not is_missing else "not solved"


def not_the_part(report: Report) -> str:
    """Return why a map is too far from its surface to stand for the part, "" where it is not."""
    return ", and ".join(report["parameterization"].get("not_the_part", ()))


def why_not_solved(report: Report) -> str:
    """Return why nothing is solved on a map unless the user asks for it, "" where nothing speaks against it."""
    reasons = [f"the map is not the part: {far}"] if (far := not_the_part(report)) else []
    if report["parameterization"]["bijective"] == "folded":
        reasons.append("the map folds")
    return "; ".join(reasons)


def solved(report: Report) -> Report:
    """Return the section of the problem that was solved, empty where nothing was solved."""
    return next((report[name] for name in SOLVED if name in report), {})


def asked(report: Report) -> list[Report]:
    """Return the answers to the asks of a run, those of its finest level; none where nothing was asked."""
    return next((section["asked"] for section in (solved(report), report.get("modes", {})) if "asked" in section), [])


def accuracy_in_words(refined: Report) -> str:
    """Return what became of the accuracy that was wanted of a solve."""
    wanted, steps = f"{100.0 * refined['accuracy']:g} %", f"{refined['steps']} step{'s' * (refined['steps'] != 1)}"
    return f"{wanted} reached in {steps}" if refined["reached"] else f"{wanted} not reached: {refined['stopped']}"


def one_to_one(report: Report) -> str:
    """Return whether the map is one-to-one: "yes", "no" or "undecided".

    "yes" needs both proofs, that det J has one sign and that the boundary does not meet itself; "no" needs a fold or a
    place where the boundary meets itself.
    """
    quality = report["parameterization"]
    if quality["bijective"] == "folded" or quality.get("boundary_injective") is False:
        return "no"
    return "yes" if quality["bijective"] == "certified" and quality.get("boundary_injective") else "undecided"


def volume_in_words(report: Report) -> tuple[str, ...]:
    """Return the spline's volume, and how far it is from the mesh's; nothing of a report without them."""
    if not (volume := report["parameterization"].get("volume")):
        return ()
    share, sense = abs(volume["difference"]), "less" if volume["difference"] < 0.0 else "more"
    beside = f"{in_percent(share)} {sense} than the mesh's" if share > SAME_VOLUME else "as the mesh's"
    return cubic(volume["spline"], report), beside


def cubic(volume: float, report: Report) -> str:
    """Return a volume with its unit, if that of lengths is known."""
    unit = report.get("input", {}).get("unit") or solved(report).get("unit")
    return f"{volume:.6g}{f' {unit}³' if unit else ''}"


def patches_of_solid(solid: Report) -> str:
    """Return the number of patches of an entry of `solids` in words."""
    return f"{solid['patches']:,} patch{'es' * (solid['patches'] > 1)}"


def control_points_in_words(report: Report) -> str:
    """Return the number of control points of `auto`, and the reason why there are not more; "" for a given number."""
    if not (refinement := report["parameterization"].get("refinement")):
        return ""
    first, last, asked = refinement["levels"][0], refinement["levels"][-1], f"tolerance {refinement['tolerance']:.2g}"
    size = size_in_words(last, " x ")
    reason = f"{asked} met"
    if refinement["stopped"] == "limit reached":
        reason = f"{asked} not met with at most {refinement['max_control_points']} per direction"
    elif refinement["stopped"] == "no better map":
        dropped = size_in_words(refinement["dropped"], " x ")
        reason = f"{asked} not met: no better map that is certified was found with {dropped}"
    start = f", {size_in_words(first, ' x ')} at first" if first != last else ""
    if "boundary" in last:  # of an older version, which knew the distance at the mesh's vertices alone
        return f"{size}{start}; rms distance {last['boundary']:.2g} of the diagonal at the vertices, {reason}"
    rms, largest = f"rms distance {last['distance']:.2g} of the diagonal", f"largest distance {last['largest']:.2g}"
    return f"{size}{start}; {rms}, {reason}; {largest}"


def surface_distance(report: Report) -> Report:
    """Return rms, mean and max of the distance between surface and spline in both directions, over the box's diagonal.

    The result is empty where the distance is unknown: for a volume without a surface, and in reports of older versions.
    """
    measured = report["parameterization"].get("surface_distance", {})
    return measured.get("two_sided", {}).get("of_diagonal", {})


def verdict(report: Report, folder: Path) -> Report:
    """Return the entries that decide whether a result can be used, as `--json` prints them."""
    quality = report["parameterization"]
    short: Report = {"folder": str(folder)}
    short |= {"not_the_part": quality["not_the_part"]} if quality.get("not_the_part") else {}
    short |= {name: report[name] for name in ("not_solved", "incomplete") if name in report}
    short["bijective"] = quality["bijective"]
    short |= {"orientation": quality["orientation"]} if "orientation" in quality else {}
    short |= {"boundary_injective": quality.get("boundary_injective"), "one_to_one": one_to_one(report)}
    if "arap" in quality:
        short["arap"] = quality["arap"]
        short["boundary_rms"] = {scale: values["rms"] for scale, values in quality["boundary"].items()}
    if distance := surface_distance(report):
        short["surface_distance"] = distance
    defects = {name: quality[name] for name in DEFECTS if quality.get(name)}
    short |= defects | {name: report[name] for name in ("advice", "not_drawn") if name in report}
    if refinement := quality.get("refinement"):
        short["refinement"] = refinement
    if found := asked(report):
        short["asked"] = found
    if section := solved(report):
        keys = ("dofs", *EXACT_ERRORS, *ESTIMATES, "iterations", "converged", "meaningful", "singular", "extremes")
        short["levels"] = [{key: level[key] for key in keys if key in level} for level in section["levels"]]
        short["notices"] = section["notices"]
    if vibration := report.get("modes"):
        shown = ("frequencies", "rigid", "residuals", "notices")
        short["modes"] = {name: vibration[name] for name in shown if name in vibration}
    short["seconds"] = report["seconds"]["total"]
    return short
