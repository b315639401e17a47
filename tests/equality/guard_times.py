"""Times of the steps of two revisions, turn by turn on the same machine."""

import h5py
import numpy as np
from guard_runs import GuardError

#: Packed drums, one thread; longer than in the comparison of bits, by this factor
SOURCES, LONGER = ("drum_12651", "drum"), 2
#: A ratio of times above this is to be looked into
GREATEST = 1.01


def seconds_per_step(side, case):
    """Time of all stages of a run over its number of steps."""
    done = side.run_case(case)
    if done[1] != 0:
        raise GuardError(f"{case.name}: the run of {side.folder.name} failed: {done[2][-500:]}")
    with h5py.File(done[0] / side.names.file("profile"), "r") as file:
        total = file[side.names.own_data("profile/profile/total")][()]
        calls = file[side.names.own_data("profile/profile/calls")][()]
    return total.sum() / calls.max()


def compare_times(base, present, repeats, say, cases):
    """Print the ratio of present over base, and whether its median is small enough; the exit code."""
    code = 0
    for case in cases:
        case.settings["integrate.duration"] = f"{LONGER * float(case.settings['integrate.duration']):.8g}"
        case.settings["output.frame_interval"] = "0"
        for side in (base, present):
            seconds_per_step(side, case)
        times = []
        for turn in range(repeats):
            order = (base, present) if turn % 2 == 0 else (present, base)
            taken = {side.folder.name: seconds_per_step(side, case) for side in order}
            times.append([taken[base.folder.name], taken[present.folder.name]])
        times = np.array(times)
        ratios = times[:, 1] / times[:, 0]
        least = times.min(axis=0)
        medians = 1e6 * np.median(times, axis=0)
        say(f"{case.name}: base {medians[0]:.1f} us per step, present {medians[1]:.1f} us; "
            f"ratio of turns: median {np.median(ratios):.4f}, least {ratios.min():.4f}, greatest {ratios.max():.4f}; "
            f"ratio of the least times {least[1] / least[0]:.4f}; {repeats} turns")
        code = code or int(min(np.median(ratios), least[1] / least[0]) > GREATEST)
    say(f"{'slower' if code else 'not slower'}: both ratios, of the median and of the least, must be above {GREATEST}")
    return code
