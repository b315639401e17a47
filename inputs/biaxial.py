"""Stress ratio, volumetric strain and solid fraction of the biaxial tests in results/biaxial_tests, with a figure."""

import matplotlib.pyplot as plt
import numpy as np
from polydem_post import Trajectory
from polydem_post.sweep import Sweep


def test(run):
    """Columns: axial strain, stress ratio, volumetric strain (compression is positive) and solid fraction."""
    result = Trajectory(run.result)
    all_rows = result.time_series
    first = np.flatnonzero(all_rows["press.load"])[-1] + 1     # the first stage, with its load, has ended
    names = ("bottom.y", "top.y", "left.x", "right.x", "top.force_y", "right.force_x")
    row = {name: all_rows[name][first:] for name in names}
    height = row["top.y"] - row["bottom.y"] - 0.04             # the walls are 0.04 m thick
    width = row["right.x"] - row["left.x"] - 0.04
    axial, lateral = row["top.force_y"] / width, row["right.force_x"] / height
    grains = result[0].mass[~result[0].fixed].sum() / 2500     # area of all grains, m2
    return np.transpose([np.log(height[0] / height), (axial - lateral) / (axial + lateral),
                         np.log(height[0] * width[0] / (height * width)), grains / (height * width)])


figure, panels = plt.subplots(1, 3, figsize=(9, 2.8), layout="constrained")
names = ["stress ratio (s1 - s2)/(s1 + s2)", "volumetric strain", "solid fraction"]
for scale, name in (("0", "dense"), ("1", "loose")):
    runs = [run for run in Sweep("results/biaxial_tests").runs if run.values["stage.compress.friction_scale"] == scale]
    tests = [test(run) for run in runs]
    edges = np.linspace(0, min(columns[-1, 0] for columns in tests), 25)
    means = np.array([[columns[(columns[:, 0] >= low) & (columns[:, 0] <= high)].mean(axis=0)
                       for low, high in zip(edges, edges[1:])] for columns in tests])
    mean, error = means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(len(runs))
    for k, panel in enumerate(panels, 1):
        panel.errorbar(mean[:, 0], mean[:, k], error[:, k], label=name, marker="o", markersize=3, capsize=2)
    peaks, late = means[:, :, 1].max(axis=1), means[:, -8:].mean(axis=1)      # late: the last third of the strain
    for what, values in (("peak of the stress ratio", peaks), ("late stress ratio", late[:, 1]),
                         ("first solid fraction", means[:, 0, 3]), ("late solid fraction", late[:, 3])):
        print(f"{name}: {what} {values.mean():.3f} +- {values.std(ddof=1) / np.sqrt(len(runs)):.3f}")
for panel, label in zip(panels, names):
    panel.set(xlabel="axial strain", ylabel=label)
panels[0].legend()
figure.savefig("biaxial_test.png", dpi=160)
