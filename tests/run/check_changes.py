"""What changes between two steps: gravity, bodies that leave or enter; with a start or a restart between them.

usage: check_changes.py PROGRAM
"""

import os
import re
import sys
import tempfile

from check_stages import FOUND, GAS, OUTPUT, SCENE, Case, hash_of


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


def what_enters_after_a_restart_moves_with_the_shear(case):
    """Finds a restart in a cell whose copies are those of time 0 until the first step."""
    cell = "&cell periodic = 'xy' size = 0.1, 0.1 shear_rate = 90 shear_ramp = 5e-3 /\n"
    cell += "&forces gravity = 0, 0 stiffness = 2e5 /\n"
    cell += GAS.replace("high = 0.1, 0.1 number = 60", "high = 0.1, 0.07 number = 40")
    cell += ("&source name = 'feed' low = 0, 0.07 high = 0.1, 0.1 rate = 5000 interval = 64 shape = 'regular'\n"
             "   corners = 5, 5 diameter = 4e-3, 4e-3 velocity = 1, 0 /\n")
    whole = case.run(cell + OUTPUT.format(duration="duration = 1.5625e-2", scheme=""), "whole")
    case.run(cell + OUTPUT.format(duration="duration = 7.8125e-3", scheme=""), "parts")
    parts = case.run(cell + OUTPUT.format(duration="duration = 1.5625e-2", scheme=""), "parts", "--continue")
    assert hash_of(parts) == hash_of(whole), (parts, whole)


def a_stiffness_that_follows_from_the_pressure_stays(case):
    """Finds a run that goes on with another stiffness; and a start from its result that does not take the present P."""
    scene = SCENE.format(seed=1).replace("stiffness = 2e5", "stiffness_over_pressure = 300")
    whole = case.run(scene + OUTPUT.format(duration="duration = 3.125e-2", scheme=""), "stiff")
    case.run(scene + OUTPUT.format(duration="duration = 1.5625e-2", scheme=""), "halves")
    halves = case.run(scene + OUTPUT.format(duration="duration = 3.125e-2", scheme=""), "halves", "--continue")
    assert hash_of(halves) == hash_of(whole), (halves, whole)
    start = FOUND + "&forces stiffness_over_pressure = 300 friction_coefficient = 0.5 /\n"
    start += "&scene name = 'result' start_from = 'stiff' /\n"
    lower = case.run(start + OUTPUT.format(duration="duration = 7.8125e-3", scheme=""), "lower", "--force")
    before, after = (float(re.search(r"^stiffness  E = (\S+) N/m2, 3.0E\+02 times", output, re.MULTILINE).group(1))
                     for output in (whole, lower))
    assert after != before, (before, after)


def main():
    case = Case(os.path.abspath(sys.argv[1]))
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        another_gravity_counts_the_whole_path(case)
        what_leaves_before_the_first_step_takes_its_energy(case)
        what_enters_after_a_restart_moves_with_the_shear(case)
        a_stiffness_that_follows_from_the_pressure_stays(case)


if __name__ == "__main__":
    main()
