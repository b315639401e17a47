"""Writes rough.h5: the bodies of the first frame of results/loose, with a row of fixed grains on the floor."""

import numpy as np
from polydem_post import Trajectory
from polydem_post.bodies_file import write_bodies

frame = Trajectory("results/loose")[0]
grains = [frame.vertices[k] for k in np.flatnonzero(frame.free)]
walls = [frame.vertices[k] for k in np.flatnonzero(frame.fixed)]
size = 0.011                                                                # m, the longest axis of a grain
places = np.arange(walls[0][:, 0].min() + size, walls[0][:, 0].max() - size, size)
fixed = [*walls, *(grain - grain.mean(axis=0) + (x, 0) for x, grain in zip(places, grains))]
free = [np.add(grain, (0, size)) for grain in grains]
write_bodies([*free, *fixed], "rough.h5", fixed=[False] * len(free) + [True] * len(fixed), overwrite=True)
