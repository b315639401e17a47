"""The energy balance closes when what acts changes between two steps.

usage: check_residuals.py PROGRAM
"""

import os
import re
import sys
import tempfile

from check_stages import FOUND, GAS, OUTPUT, SCENE, Case


def residual_of(output):
    """Residual of the energy relative to the largest energy or work."""
    return float(re.search(r"energy (\S+) of the largest", output).group(1))


def another_gravity_counts_the_whole_path(case):
    """Finds a jump of the potential energy without the crossings of the border of a cell."""
    cell = "&cell periodic = 'xy' size = 0.1, 0.1 /\n&forces gravity = 30, 0 stiffness = 2e5 friction = 'none' /\n"
    stages = ("&stage name = 'along' duration = 7.8125e-2 /\n"
              "&stage name = 'across' duration = 7.8125e-3 gravity = -200, -300 /\n")
    output = case.run(cell + GAS + stages + OUTPUT.format(duration="", scheme=""), "turned")
    assert residual_of(output) < 0.01, output


def what_leaves_before_the_first_step_takes_its_energy(case):
    """Finds a start from a checkpoint that has lost the forces of its first state."""
    forces = "&forces law = 'conservative' gravity = 0, -300 stiffness = 2e5 friction = 'none' /\n"
    scene = SCENE.format(seed=1).replace("&forces stiffness = 2e5 friction_coefficient = 0.5 /\n", forces)
    rest = OUTPUT.format(duration="duration = 3.125e-2", scheme="")
    case.run(scene + rest, "pressed")
    start = FOUND + forces + "&scene name = 'result' start_from = 'pressed' /\n"
    start += "&sink name = 'bin' low = -0.05, -0.01 high = 0.05, 0.02 interval = 1000 /\n"
    output = case.run(start + rest, "left", "--force")
    assert residual_of(output) < 1e-3, output


def main():
    case = Case(os.path.abspath(sys.argv[1]))
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        another_gravity_counts_the_whole_path(case)
        what_leaves_before_the_first_step_takes_its_energy(case)


if __name__ == "__main__":
    main()
