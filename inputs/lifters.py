"""Writes lifters.nml: a drum with lifters, one wall that is a closed polyline."""

import numpy as np

radius, height, width, lifters = 0.15, 0.02, 0.024, 8                # m
half = 0.5 * width / radius                                          # of a lifter, as an angle
corners = []
for foot in 2 * np.pi * np.arange(lifters) / lifters:
    corners += [(radius, foot - half), (radius - height, foot - half), (radius - height, foot + half)]
    corners += [(radius, angle) for angle in np.linspace(foot + half, foot + 2 * np.pi / lifters - half, 6)[:-1]]
vertices = ", ".join(f"{r * np.cos(angle):.6f}, {r * np.sin(angle):.6f}" for r, angle in corners)
with open("lifters.nml", "w") as file:
    file.write(f"""&wall name = 'liner' outline = 'polyline' closed = .true. thickness = 0.01 vertices = {vertices} /
&grains name = 'grains' region = 'disc' radius = {0.95 * (radius - height)} number = 200 /
&motion name = 'turn' kind = 'rotation' rate = 0.3 /
&integrate duration = 3 /
""")
