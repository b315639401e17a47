"""Exponent of the flow out of the silos in results/silo, and its figure."""

import matplotlib.pyplot as plt
import numpy as np
from polydem_post import Trajectory
from polydem_post.sweep import Sweep

rates = {}
for run in Sweep("results/silo").runs:
    opening = 2 * float(run.values["wall.bottom_right.low"].split(",")[0])
    gone = Trajectory(run.result).departures
    first = len(gone["mass"]) // 3
    rates.setdefault(opening, []).append(gone["mass"][first + 1:].sum() / (gone["time"][-1] - gone["time"][first]))

width, flows = np.array(list(rates)), np.array(list(rates.values()))          # m; kg/(m s), one row per opening
flow, scatter = flows.mean(axis=1), flows.std(axis=1, ddof=1) / flows.mean(axis=1)
error = np.sqrt(np.mean(scatter**2)) * flow / np.sqrt(flows.shape[1])         # one relative scatter for all openings
for row in zip(1000 * width, flow, error):
    print("opening {:.0f} mm: {:.1f} +- {:.1f} kg/(m s)".format(*row))


def fit(k, n):
    """Best factor of a law, and sum of its squared residuals over squared errors."""
    law = np.maximum(width / 0.00875 - k, 0.0)**n
    factor = np.sum(flow * law / error**2) / np.sum(law**2 / error**2)
    return factor, np.sum(((flow - factor * law) / error)**2)


ks, ns = np.linspace(-4, 6, 401), np.linspace(0.5, 3, 251)
squares = np.array([[fit(k, n)[1] for n in ns] for k in ks])
inside = ns[squares.min(axis=0) < squares.min() + 1]
i, j = np.unravel_index(squares.argmin(), squares.shape)
print(f"free: n = {ns[j]:.2f}, {inside.min():.2f} to {inside.max():.2f}, k = {ks[i]:.2f}, "
      f"chi2 {squares.min():.1f} for 2")
column = squares[:, np.abs(ns - 1.5).argmin()]
k, near = ks[column.argmin()], ks[column < column.min() + 1]
print(f"n = 3/2: k = {k:.2f}, {near.min():.2f} to {near.max():.2f}, C = {fit(k, 1.5)[0]:.2f}, "
      f"chi2 {column.min():.1f} for 3")

figure, panel = plt.subplots(figsize=(5, 3.2), layout="constrained")
panel.errorbar(1000 * width, flow, error, fmt="o", markersize=4, capsize=2, label="polydem, means over seeds")
line = np.linspace(0.05, 0.115)
panel.plot(1000 * line, fit(k, 1.5)[0] * (line / 0.00875 - k)**1.5, label="$C (D - k d)^{3/2}$")
panel.set(xlabel="opening [mm]", ylabel="flow [kg/(m s)]")
panel.legend()
figure.savefig("beverloo.png", dpi=160)
