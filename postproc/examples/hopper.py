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
first, last = np.searchsorted(passed, [0.2 * passed[-1], 0.6 * passed[-1]])    # neither start nor end
steady = slice(first, max(first + 1, last))
rate = (passed[steady.stop] - passed[steady.start]) / (flow.times[steady.stop] - flow.times[steady.start])
print(f"{int(flow.bodies.sum())} of {BODIES} bodies fall; {rate:.1f} kg/(m s) while the hopper is full")

# %% [markdown]
# ## Inside the hopper
#
# The velocity across the opening while the flow is steady, and one frame in the middle of that time: forces, and the
# stress field.

# %% Measures inside
frame = run.at(0.5 * (flow.times[steady.start] + flow.times[steady.stop]))
across = measure.profile(run[steady], "velocity", np.linspace(-0.5 * OPENING, 0.5 * OPENING, 7), axis="x",
                         between=(-0.01, 0.02), weight="mass")
forces = measure.force_distribution(frame, bins=np.linspace(0.0, 6.0, 13))
diameter = float(np.median(frame.equivalent_diameter[frame.free]))
fields = measure.coarse_grain(frame, measure.lucy(3.0 * diameter), 0.5 * diameter)
pressure = 0.5 * np.trace(fields.stress, axis1=2, axis2=3)
print(f"t = {frame.time:.3f} s: coordination {measure.coordination_number(frame):.2f}, without rattlers "
      f"{measure.coordination_number(frame, with_rattlers=False):.2f}; mean normal force {forces.mean:.3g} N/m")

# %% [markdown]
# ## The figure

# %% Figure
figure = Figure(figsize=(11.0, 7.0), layout="constrained")
axes = figure.subplot_mosaic([["flow", "velocity", "pressure"], ["forces", "forces", "pressure"]],
                             width_ratios=[1.0, 1.0, 0.8])

axes["flow"].plot(flow.times, passed, color="black")
axes["flow"].plot(flow.times[[steady.start, steady.stop]], passed[[steady.start, steady.stop]], color="tab:red",
                  linewidth=3, label=f"{rate:.1f} kg/(m s)")
axes["flow"].set(xlabel="time [s]", ylabel="discharged mass [kg/m]", title="flow through the opening")
axes["flow"].legend(frameon=False)

axes["velocity"].plot(across.centres, -across.mean[:, 1], "o-", color="black")
axes["velocity"].set(xlabel="x [m]", ylabel="speed downwards [m/s]", title="velocity across the opening")
axes["velocity"].set_ylim(bottom=0.0)

axes["forces"].semilogy(forces.centres, np.where(forces.density > 0.0, forces.density, np.nan), "s", color="black")
axes["forces"].set(xlabel="normal force / mean", ylabel="probability density", title="contact forces")

shown = np.where(fields.density > 0.05 * fields.density.max(), pressure, np.nan)
image = axes["pressure"].pcolormesh(fields.x, fields.y, shown, cmap="viridis", shading="nearest", vmin=0.0)
axes["pressure"].add_collection(PolyCollection(frame.vertices, facecolor="none", edgecolor="black", linewidth=0.4))
axes["pressure"].set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title=f"pressure at t = {frame.time:.2f} s")
axes["pressure"].autoscale_view()
figure.colorbar(image, ax=axes["pressure"], label="N/m$^2$")

path = RESULT / "discharge.png"
figure.savefig(path, dpi=150)
print(path)
