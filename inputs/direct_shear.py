"""Strength and dilation of the direct shear tests in results/shear_tests."""

import numpy as np
from polydem_post import Trajectory
from polydem_post.sweep import Sweep

for scale, name in (("0", "dense"), ("1", "loose")):
    runs = [run for run in Sweep("results/shear_tests").runs if run.values["stage.compress.friction_scale"] == scale]
    values = []
    for run in runs:
        row = Trajectory(run.result).time_series
        moved = row["back.x"] - row["back.x"][0]                               # m
        means = []
        for low in np.arange(0.001, 0.045, 0.002):
            there = (moved >= low) & (moved < low + 0.002)
            ratio = row["lower.force_x"][there].mean() / row["lid.force_y"][there].mean()
            means.append([ratio, row["lid.y"][there].mean()])
        ratio, height = np.transpose(means)
        values.append([ratio.max(), ratio[-8:].mean(), 1e3 * (height[-1] - row["lid.y"][np.argmax(moved > 0)])])
    mean, error = np.mean(values, axis=0), np.std(values, axis=0, ddof=1) / np.sqrt(len(runs))
    for k, what in enumerate(("largest ratio", "late ratio", "rise of the lid [mm]")):
        print(f"{name}: {what} {mean[k]:.3f} +- {error[k]:.3f}")
