"""Strength of the samples of regular polygons in results/corners, by number of corners."""

import numpy as np
from polydem_post import Trajectory
from polydem_post.sweep import Sweep

ratios, fractions = {}, {}
for run in Sweep("results/corners").runs:
    result = Trajectory(run.result)
    row = result.time_series
    first = np.flatnonzero(row["press.load"])[-1] + 1          # the first stage, with its load, has ended
    height, width = row["top.y"] - row["bottom.y"] - 0.04, row["right.x"] - row["left.x"] - 0.04
    late = np.flatnonzero(height < 0.9 * height[first])        # from an axial strain of 0.1 on
    axial, lateral = row["top.force_y"][late] / width[late], row["right.force_x"][late] / height[late]
    corners = int(run.values["grains.sample.corners"].split(",")[0])
    ratios.setdefault(corners, []).append(np.mean((axial - lateral) / (axial + lateral)))
    grains = result[0].mass[~result[0].fixed].sum() / 2500     # area of all grains, m2
    fractions.setdefault(corners, []).append(np.mean(grains / (height[late] * width[late])))
for corners, found in ratios.items():
    errors = [np.std(values, ddof=1) / np.sqrt(len(values)) for values in (found, fractions[corners])]
    print(f"{corners} corners: stress ratio {np.mean(found):.3f} +- {errors[0]:.3f}, "
          f"solid fraction {np.mean(fractions[corners]):.3f} +- {errors[1]:.3f}")
