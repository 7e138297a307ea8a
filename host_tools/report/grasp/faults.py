"""Every fault in every state of a grasp: what fingertip_grasp_kinds --faults found, for grasp.json and grasp.md."""

import kinds
from fingertip.files import InputError

GOALS = (("faults_opened", "<=", 0), ("faults_beyond_cap", "<=", 0), ("faults_unsaid", "<=", 0), ("cups_crushed", "<=", 0))


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
            "reported": joined(group, "reported"),
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
    judged = [row for row in rows if not row["untold"]]
    return {
        "faults": table_of(rows),
        "faults_grasps": len(rows),
        "faults_opened": sum(row["opened"] for row in judged),
        "faults_beyond_cap": sum(row["beyond_cap"] for row in judged),
        "faults_unsaid": sum(row["unsaid"] for row in judged),
        "cups_crushed": sum(row["crushed"] for row in judged),
    }
