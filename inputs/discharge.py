"""Flow rates of the hoppers in results/hoppers by the width of their opening, beside Beverloo's law, with a figure."""

import matplotlib.pyplot as plt
import numpy as np
from polydem_post import Trajectory
from polydem_post.analysis import block_average, mass_beyond
from polydem_post.sweep import Sweep

series = {}                                                                      # flow rates of each opening, by seed
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
for row in Sweep("results/hoppers").runs:
    run = Trajectory(row.result)
    scene = run.settings.scene
    mass = np.array([mass_beyond(frame, (0, 0), (0, -1)) for frame in run])      # below y = 0
    steady = run.times > 0.5 * run.times[-1]
    series.setdefault(scene.opening, []).append(np.diff(mass[steady]) / np.diff(run.times[steady]))
    if scene.seed == 1:
        left.plot(run.times, mass, label=f"{100 * scene.opening:.0f} cm")
left.set(xlabel="time [s]", ylabel="mass below the opening [kg/m]")
left.legend()

openings = np.array(list(series))
found = [block_average(np.concatenate(rates)) for rates in series.values()]      # the seeds one after the other
flow, error = np.array([(each.mean, each.error) for each in found]).T
power, spread = flow ** (2 / 3), 2 / 3 * flow ** (-1 / 3) * error
(slope, shift), covariance = np.polyfit(openings, power, 1, w=1 / spread, cov="unscaled")
residuals = (power - slope * openings - shift) / spread
right.errorbar(openings, power, spread, fmt=".", capsize=4)
width = np.array([-shift / slope, max(openings)])
right.plot(width, slope * width + shift)
right.set(xlabel="opening [m]", ylabel="(flow rate)$^{2/3}$ [(kg/m/s)$^{2/3}$]")
figure.savefig("discharge.png", dpi=150)

for opening, rates, each, residual in zip(openings, series.values(), found, residuals):
    seeds = ", ".join(f"{np.mean(rate):.1f}" for rate in rates)
    print(f"{opening:.2f} m: {each.mean:.1f} +- {each.error:.1f} kg/m/s, {each.blocks} blocks; seeds {seeds}; "
          f"residual {residual:.1f}")
diameter = np.median(run[0].equivalent_diameter[run[0].free])
change = np.array([shift / slope**2, -1 / slope]) / diameter                     # derivatives of k
print(f"k = {-shift / slope / diameter:.2f} +- {np.sqrt(change @ covariance @ change):.2f}")
print(f"C rho_b = {slope**1.5 / 9.81**0.5:.0f} +- {1.5 * (slope * covariance[0, 0] / 9.81)**0.5:.0f} kg/m3")
print(f"chi^2 = {np.sum(residuals**2):.1f} for {len(openings) - 2} degrees of freedom")
