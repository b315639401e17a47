"""What workers have in common: they answer requests on standard input until it ends.

A line names a file with a request (JSON: scene, knobs, samples, steps_per_sample, dt, least_seconds, most_runs) and,
after a tabulator, a file for the states at the samples (bodies x (x, y, angle, vx, vy, w), float64). The answer is a
line that begins with ANSWER and has the processor seconds of stepping of each repetition, as many as least_seconds
asks for.
"""

import json
import math
import sys
import time

import numpy as np

#: Marks an answer among what libraries print
ANSWER = "rivals:"


def area_and_inertia(vertices):
    """Area of a convex polygon about its centroid, and its second moment."""
    x, y = np.asarray(vertices, dtype=float).T
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y1 - x1 * y
    return cross.sum() / 2.0, (cross * (x * x + x * x1 + x1 * x1 + y * y + y * y1 + y1 * y1)).sum() / 12.0


class Turns:
    """Angles without jumps from angles between -pi and pi."""

    def __init__(self, angles):
        self.last = np.array(angles, dtype=float)
        self.total = self.last.copy()

    def follow(self, angles):
        """The angles that continue the last ones."""
        now = np.array(angles, dtype=float)
        self.total = self.total + (now - self.last + math.pi) % (2.0 * math.pi) - math.pi
        self.last = now
        return self.total


def run(build, request):
    """States at all samples, and the processor seconds of stepping."""
    step, states = build(request["scene"], request["dt"], request["knobs"])
    found, seconds = [states()], 0.0
    for _ in range(request["samples"]):
        began = time.process_time()
        step(request["steps_per_sample"])
        seconds += time.process_time() - began
        found.append(states())
    return np.array(found, dtype=float), seconds


def serve(build):
    """Answer requests; `build` makes of scene, dt and knobs what does n steps, and what gives the states."""
    for line in sys.stdin:
        source, target = line.rstrip("\n").split("\t")
        with open(source, encoding="utf-8") as file:
            request = json.load(file)
        states, first = run(build, request)
        seconds = [first]
        while sum(seconds) < request["least_seconds"] and len(seconds) < request["most_runs"]:
            seconds.append(run(build, request)[1])
        states.tofile(target)
        print(ANSWER, *map(repr, seconds), flush=True)
