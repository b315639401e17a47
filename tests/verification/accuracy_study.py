"""Do the entries that ./polydem accuracy recommends keep the tolerance? Thirty random scenes, once per force law.

usage: accuracy_study.py PROGRAM FOLDER [SEED]       (default: 1000)

For each law it writes accuracy_LAW_SEED.csv to FOLDER: requested, estimated and achieved error of one quantity of each
scene. Errors are shares of the scale of the quantity. The achieved one is the difference of a run with the recommended
entries from a run at 100 times the stiffness and a quarter of the step of the scene there. It takes six minutes of one
core.
"""

import csv
import os
import random
import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "postproc" / "src"))

from polydem_post.accuracy.study import Request, study_accuracy
from polydem_post.accuracy.windows import Window
from polydem_post.read.trajectory import Trajectory
from polydem_post.sweep.batch import Row, lay_out
from polydem_post.sweep.runner import FINISHED, Runner, last_words, state_of

LAWS = ("conservative", "polar")
COLUMNS = ("scene", "quantity", "requested", "estimated", "achieved", "refused", "stiffness", "steps", "order")

#: The finest run, and the requirements
FINEST = Window(stiffness=100.0, step=0.25)
MOST_REFUSED, SCENES_IN_ALL, KEPT_SHARE = 5, 30, 28 / 30


def slide(draw):
    """A block slides down an incline."""
    friction = draw.uniform(0.05, 0.35)
    return (f"&scene name = 'incline' width = {draw.uniform(0.01, 0.03):.4f} height = {draw.uniform(0.005, 0.01):.4f}"
            f" slope = {draw.uniform(24.0, 40.0):.2f} /\n&forces friction_coefficient = {friction:.3f} /\n"
            f"&integrate duration = {draw.uniform(0.08, 0.15):.3f} /\n", "body.1.x", 1e-2)


def impact(draw):
    """A polygon meets a floor with a corner, with spin and with or without friction."""
    corners = draw.choice((3, 4, 5, 6))
    return (f"&grains name = 'one' region = 'at' at = 0, 0.0101 shape = 'regular' corners = {corners}, {corners}"
            f" diameter = 0.02, 0.02 angle = {(tilt := draw.uniform(5.0, 85.0)):.2f}, {tilt:.2f}"
            f" velocity = {draw.uniform(-0.3, 0.3):.3f}, {-draw.uniform(0.3, 1.0):.3f} /\n"
            "&wall name = 'floor' outline = 'line' from = -0.2, 0 to = 0.2, 0 thickness = 0.02 /\n"
            f"&forces stiffness = 1e9 gravity = 0, 0 restitution = {draw.uniform(0.5, 1.0):.2f}"
            f" friction_coefficient = {draw.choice((0.0, 0.2, 0.6))} /\n&integrate duration = 0.02 /\n",
            f"body.1.{draw.choice(('vy', 'spin'))}", 1e-1)


def stack(draw):
    """Blocks on each other slide, or fall a little, and tilt and sink."""
    number, height = draw.randint(2, 5), draw.uniform(0.005, 0.01)
    text = f"&scene name = 'stack' bodies = {number} width = {draw.uniform(0.015, 0.03):.4f} height = {height:.4f} /\n"
    if draw.random() < 0.5:
        return (text + "&forces stiffness = 1e8 gravity = 4.9, -8.5 friction_coefficient = "
                f"{draw.uniform(0.2, 0.4):.3f} /\n&integrate duration = 0.08 /\n", f"body.{number}.x", 1e-2)
    blocks = "".join(
        f"&grains name = 'block_{k}' region = 'at' at = {draw.uniform(-0.002, 0.002):.5f}, {(k + 0.55) * height:.5f}"
        f" shape = 'rectangle' width = 0.02 height = {height * 0.98:.5f} /\n" for k in range(number))
    return (blocks + "&wall name = 'floor' outline = 'line' from = -0.2, 0 to = 0.2, 0 thickness = 0.02 /\n"
            f"&forces restitution = {draw.uniform(0.1, 0.5):.2f} /\n&integrate duration = 0.06 /\n",
            f"body.{number}.y={height:.4f}", 1e-2)


def pile(draw):
    """Grains fall into a cup."""
    return (f"&grains name = 'grains' region = 'box' low = 0, 0.001 high = 0.05, 0.07 number = {draw.randint(14, 20)}"
            f" seed = {draw.randint(1, 10**6)} /\n"
            "&wall name = 'cup' outline = 'polyline' vertices = 0, 0.1, 0, 0, 0.05, 0, 0.05, 0.1 thickness = 0.01 /\n"
            f"&forces friction_coefficient = {draw.uniform(0.1, 0.5):.2f}"
            f" restitution = {draw.uniform(0.2, 0.4):.2f} /\n"
            f"&integrate duration = {draw.uniform(0.05, 0.07):.3f} /\n", "centre.y", 2e-2)


def hopper(draw):
    """Grains flow out of a small silo."""
    return (f"&scene name = 'hopper' bodies = {draw.randint(15, 25)} opening = {draw.uniform(0.03, 0.045):.3f}"
            f" slope = {draw.choice((30, 45, 60))} seed = {draw.randint(1, 10**6)} /\n"
            f"&forces friction_coefficient = {draw.uniform(0.1, 0.5):.2f} restitution = 0.3 /\n"
            f"&integrate duration = {draw.uniform(0.05, 0.07):.3f} /\n", "centre.y", 2e-2)


def gas(draw):
    """Grains fly and collide without gravity."""
    return (f"&scene name = 'gas' bodies = {draw.randint(12, 25)} solid_fraction = {draw.uniform(0.15, 0.3):.2f}"
            f" speed = {draw.uniform(0.3, 1.0):.2f} seed = {draw.randint(1, 10**6)} /\n"
            f"&forces stiffness = 1e8 gravity = 0, 0 restitution = {draw.uniform(0.5, 0.9):.2f}"
            f" friction_coefficient = {draw.choice((0.0, 0.3))} /\n&integrate duration = 0.008 /\n",
            "kinetic_energy:mean", 3e-2)


KINDS = (slide, impact, stack, pile, hopper, gas)


def scenes(seed=1000):
    """Name, namelist, quantity and tolerance of each scene; `seed` is that of the first."""
    for number in range(SCENES_IN_ALL):
        kind = KINDS[number % len(KINDS)]
        draw = random.Random(seed + number)
        yield f"{kind.__name__}_{number // len(KINDS) + 1}", *kind(draw)


def judge(program, folder, law, name, text, word, tolerance):
    """One row of the table."""
    namelist = folder / f"{name}.nml"
    namelist.write_text(text, encoding="utf-8")
    request = Request(namelist, program, tolerance, (word,), entries=(f"forces.law={law}",), output=folder / name)
    row = {"scene": name, "quantity": word, "requested": tolerance, "estimated": "", "achieved": "", "refused": "",
           "stiffness": "", "steps": "", "order": ""}
    outcome = study_accuracy(request, lambda line: None)
    (key, found), = outcome.estimates.items()
    chosen = outcome.recommended
    row["order"] = "" if found.order is None else f"{found.order:.2f}"
    if not found.is_usable or chosen is None:
        row["refused"] = found.reason or outcome.reason
        return row
    study, scale = outcome.study, outcome.scales[key]
    study.run([FINEST], "finest")
    exact = outcome.quantities[key].value(study.result(FINEST))
    achieved = outcome.quantities[key].value(run_entries(study, chosen)) - exact
    row.update(estimated=f"{chosen.errors.get(key, 0.0):.2e}", achieved=f"{abs(achieved) / scale:.2e}",
               stiffness=f"{chosen.window.stiffness:g}", steps=f"{chosen.cost:.2g}")
    return row


def run_entries(study, chosen):
    """The result of a run with the recommended entries, as a user writes them."""
    folder = study.folder / "recommended"
    if folder.exists():
        shutil.rmtree(folder)
    columns, values = zip(*chosen.entries.items())
    depth = repr(study.depth / chosen.window.stiffness) if study.depth else ""
    sweep = lay_out(study.scene, folder, [*columns, "scene.remove_overlap"], [Row("run", (*values, depth), "study")])
    Runner(study.program, 1, 1, lambda line: None).run(sweep.runs)
    if state_of(sweep.runs[0]) != FINISHED:
        raise SystemExit(f"{folder}: {last_words(sweep.runs[0])}")
    return Trajectory(sweep.runs[0].result)


def main():
    """Judge all scenes with each law; exit code 1 if too many are refused or miss the tolerance."""
    program, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
    passed = True
    for law in LAWS:
        place = folder / law
        place.mkdir(parents=True, exist_ok=True)
        rows = []
        for name, text, word, tolerance in scenes(seed):
            rows.append(judge(program, place, law, name, text, word, tolerance))
            print(law, *rows[-1].values(), flush=True)
        with open(folder / f"accuracy_{law}_{seed}.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        judged = [row for row in rows if not row["refused"]]
        kept = [row for row in judged if float(row["achieved"]) <= float(row["requested"])]
        refused = len(rows) - len(judged)
        print(f"{law}: {refused} of {len(rows)} refused; {len(kept)} of {len(judged)} keep the tolerance", flush=True)
        passed = passed and refused <= MOST_REFUSED and len(kept) >= KEPT_SHARE * len(judged)
    return 0 if passed else 1


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.exit(main())
