"""Every fault in every state of a grasp: what fingertip_grasp_kinds --faults found, for grasp.json and grasp.md."""

import kinds
from fingertip.files import InputError
from presentation import table_md

GOALS = (("faults_opened", "<=", 0), ("faults_beyond_cap", "<=", 0), ("faults_unsaid", "<=", 0), ("cups_crushed", "<=", 0))
ABOUT = """Each fault begins in each state of a grasp of each object (a paper cup that 5 N crush, a lime, a ball; caps of 4, 8 and 10 N), on a 2F-85 and
on the servo; 0.8 s later the hand lifts, if it has not yet, then the mass doubles. Opened: by 1 mm more than the same grasp
without the fault, and not asked to.
Beyond the cap: a true force above it. A row is the worst of both grippers and all objects; said: what was reported of any of them."""
# No controller can distinguish this: fingertips whose readings froze before anything touched them feel what fingertips in air do.
UNTOLD = """Not counted: both fingertips whose readings freeze before they touch. They report what they would report in air, so the gripper closes until its own limit
of force stops it, at the least it can be set to: a 2F-85 to 20 N."""
COLUMNS = ("fault", "state", "said", "ends", "opened, mm", "greatest force, N", "of the cap", "crushed")


def joined(rows, key):
    return sorted({word for row in rows for word in row[key].split()})


def table_of(rows):
    """One for each fault and state, the worst of its grasps."""
    groups = {}
    for row in rows:
        groups.setdefault((row["fault"], row["state"], row["untold"]), []).append(row)
    return [
        {
            "fault": fault,
            "state": state,
            "untold": untold,
            "grasps": len(group),
            "said": joined(group, "said"),
            "ends": joined(group, "ends"),
            "opened_mm": max(row["opened_mm"] for row in group),
            "peak_N": max(row["peak_N"] for row in group),
            "of_cap": max(row["peak_N"] / row["cap_N"] for row in group),
            "crushed": sum(row["crushed"] for row in group),
        }
        for (fault, state, untold), group in groups.items()
    ]


def measure(build):
    rows = kinds.found_by(build, "--faults")["rows"]
    never = [row for row in rows if not row["begun"]]
    if never:
        raise InputError(f"{never[0]['fault']} never began in {never[0]['state']}: the grasp came not so far")
    told = [row for row in rows if not row["untold"]]
    return {
        "faults": table_of(rows),
        "faults_grasps": len(rows),
        "faults_opened": sum(row["opened"] for row in told),
        "faults_beyond_cap": sum(row["beyond_cap"] for row in told),
        "faults_unsaid": sum(row["unsaid"] for row in told),
        "cups_crushed": sum(row["crushed"] for row in told),
    }


def text(found):
    cells = [
        [
            row["fault"] + (" (not counted)" if row["untold"] else ""),
            row["state"],
            " ".join(row["said"]).replace("_", " ") or "nothing",
            " ".join(row["ends"]),
            f"{row['opened_mm']:.2f}",
            f"{row['peak_N']:.1f}",
            f"{row['of_cap']:.2f}",
            str(row["crushed"]),
        ]
        for row in found["faults"]
    ]
    return [*ABOUT.split("\n"), "", *UNTOLD.split("\n"), "", *table_md(list(COLUMNS), cells), ""]
