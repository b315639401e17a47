"""Discharge of a hopper: from the run to the figure."""

# %% [markdown]
# # Discharge of a hopper: from the run to the figure
#
# How fast do polygons flow out of a hopper, and where do they carry load? This script runs the scene, reads the result,
# measures, and draws one figure. Editors that know cells (`# %%`) run it step by step, as a notebook; or
#
#     .venv/bin/python postproc/examples/hopper.py
#
# A copy with other numbers is a good start for your own study.

# %% Choices
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from polydem_post import Trajectory
from polydem_post import analysis as measure

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("POLYDEM_PROGRAM", str(ROOT / "polydem"))

BODIES = int(os.environ.get("EXAMPLE_BODIES", "300"))
OPENING = 0.05        # m
DURATION = 0.8        # s
RESULT = Path(os.environ.get("EXAMPLE_RESULT", "results/hopper_example"))

# %% [markdown]
# ## The run
#
# Each `--set` changes one entry of the namelist. Contacts are needed for forces and stresses. A run that exists is read
# again, since a run of the same input gives the same bits.

# %% Run
CHOICES = {
    "scene.bodies": BODIES, "scene.opening": OPENING, "integrate.duration": DURATION,
    "output.contacts": ".true.", "output.frame_interval": 0.01, "output.folder": f"'{RESULT}'",
}
if not (RESULT / "profile.h5").exists():
    words = [f"--set={entry}={value}" for entry, value in CHOICES.items()]
    done = subprocess.run([PROGRAM, "run", str(ROOT / "inputs" / "hopper.nml"), *words], stdout=subprocess.DEVNULL,
                          check=False)
    if done.returncode != 0:
        sys.exit(done.returncode)

run = Trajectory(RESULT)
print(run)
print(f"E = {run.settings.forces.stiffness:g} N/m2, friction {run.settings.forces.friction_coefficient}")

# %% [markdown]
# ## Flow through the opening
#
# The opening is at y = 0. Bodies that pass a line from left to right, looking along it, count as positive. This line
# runs along the x axis, so what falls is positive.

# %% Flow
flow = measure.flow_rate(run, (-0.5 * OPENING, 0.0), (0.5 * OPENING, 0.0))
passed = np.concatenate([[0.0], np.cumsum(flow.mass)])
first, last = np.flatnonzero(flow.mass > 0.0)[[0, -1]]
steady = slice(first, first + max(1, (last - first) // 2))
rate = flow.mass[steady].sum() / (flow.times[steady.stop] - flow.times[steady.start])
print(f"{int(flow.bodies.sum())} of {BODIES} bodies fall; {rate:.1f} kg/(m s) while the hopper is full")

# %% [markdown]
# ## Inside the hopper
#
# One frame in the middle of the discharge: velocity across the opening, forces, and the stress field.

# %% Measures of one frame
frame = run.at(0.5 * (flow.times[steady.start] + flow.times[steady.stop]))
across = measure.profile(frame, "velocity", np.linspace(-0.5 * OPENING, 0.5 * OPENING, 7), axis="x",
                         between=(-0.01, 0.02), weight="mass")
forces = measure.force_distribution(frame, bins=np.linspace(0.0, 6.0, 13))
diameter = float(np.median(frame.diameter[frame.free]))
fields = measure.coarse_grain(frame, measure.lucy(3.0 * diameter), 0.5 * diameter)
pressure = 0.5 * np.trace(fields.stress, axis1=2, axis2=3)
print(f"t = {frame.time:.3f} s: coordination {measure.coordination_number(frame):.2f}, without rattlers "
      f"{measure.coordination_number(frame, with_rattlers=False):.2f}; mean normal force {forces.mean:.3g} N/m")

# %% [markdown]
# ## The figure

# %% Figure
figure = Figure(figsize=(10.0, 8.0), layout="constrained")
axes = figure.subplots(2, 2)

axes[0, 0].plot(flow.times, passed, color="black")
axes[0, 0].plot(flow.times[[steady.start, steady.stop]], passed[[steady.start, steady.stop]], color="tab:red",
                linewidth=3, label=f"{rate:.1f} kg/(m s)")
axes[0, 0].set(xlabel="time [s]", ylabel="discharged mass [kg/m]", title="flow through the opening")
axes[0, 0].legend(frameon=False)

axes[0, 1].plot(across.centres, -across.mean[:, 1], "o-", color="black")
axes[0, 1].set(xlabel="x [m]", ylabel="speed downwards [m/s]", title="velocity across the opening", ylim=(0, None))

axes[1, 0].semilogy(forces.centres, np.where(forces.density > 0.0, forces.density, np.nan), "s", color="black")
axes[1, 0].set(xlabel="normal force / mean", ylabel="probability density", title="contact forces")

shown = np.where(fields.density > 0.05 * fields.density.max(), pressure, np.nan)
image = axes[1, 1].pcolormesh(fields.x, fields.y, shown, cmap="viridis", shading="nearest", vmin=0.0)
axes[1, 1].add_collection(PolyCollection(frame.vertices, facecolor="none", edgecolor="black", linewidth=0.4))
axes[1, 1].set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title=f"pressure at t = {frame.time:.2f} s")
axes[1, 1].autoscale_view()
figure.colorbar(image, ax=axes[1, 1], label="N/m$^2$")

path = RESULT / "discharge.png"
figure.savefig(path, dpi=150)
print(path)
