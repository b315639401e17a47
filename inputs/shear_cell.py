"""Stress ratio, inertial number and velocity profile of results/shear_cell, with errors."""

import numpy as np
from polydem_post import Trajectory
from polydem_post.analysis import block_average, profile

run = Trajectory("results/shear_cell")
row = run.time_series
moves = row["upper.x"] > row["upper.x"][0]                          # since the second stage
half = 0.5 * (row["time"][moves][0] + row["time"][-1])              # s
late = row["time"] > half
ratio = block_average(row["upper.force_x"][late] / row["press.load"][late])
print(f"stress ratio {ratio.mean:.3f} +- {ratio.error:.3f}, inertial number {row['inertial_number'][late].mean():.3g}, "
      f"solid fraction {row['solid_fraction'][late].mean():.3f}")
velocity = profile(run[run.times > half], "velocity", np.linspace(row["lower.y"][-1], row["upper.y"][late].mean(), 13))
for y, mean, error in zip(velocity.centres, velocity.mean[:, 0], velocity.error[:, 0]):
    print(f"y = {y:.3f} m: {mean:.3f} +- {error:.3f} m/s")
