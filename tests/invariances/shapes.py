"""Shapes of bodies: corners in the plane, m."""

import math

import numpy as np


def unit(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def box(low, high):
    return np.array([low, [high[0], low[1]], high, [low[0], high[1]]])


def corners(body):
    return np.concatenate(body.pieces)


def turned(piece, angle, place):
    c, s = math.cos(angle), math.sin(angle)
    return piece @ np.array([[c, s], [-s, c]]) + place


def regular(place, radius, n, phase):
    angles = phase + 2*math.pi*np.arange(n)/n
    return place + radius*np.stack([np.cos(angles), np.sin(angles)], axis=1)


def random_convex(dice, place, radius):
    """Corners on a circle, at uneven angles."""
    n = dice.randint(3, 7)
    gaps = np.array([dice.uniform(1, 2.5) for _ in range(n)])
    angles = dice.uniform(0, 6.28) + np.cumsum(gaps)*2*math.pi/gaps.sum()
    return place + radius*np.stack([np.cos(angles), np.sin(angles)], axis=1)


def cross(radius):
    long, arm = 0.95*radius, 0.35*radius
    return [box(np.array([-long, -arm]), np.array([long, arm])), box(np.array([-arm, arm]), np.array([arm, long])),
            box(np.array([-arm, -long]), np.array([arm, -arm]))]


def angle_iron(radius):
    long, arm = 0.65*radius, 0.1*radius
    return [box(np.array([-long, -long]), np.array([long, -arm])), box(np.array([-long, -arm]), np.array([-arm, long]))]


def cut_square(radius):
    half = 0.68*radius
    return [box(np.array([-half, -half]), np.array([0.2*half, half])),
            box(np.array([0.2*half, -half]), np.array([half, half]))]


def table(feet, low, high):
    """A slab on feet."""
    width, leg = (high[0] - low[0])/(2*feet - 1), low[1] + 0.4*(high[1] - low[1])
    lefts = [low[0] + 2*k*width for k in range(feet)]
    return [box(np.array([left, low[1]]), np.array([left + width, leg])) for left in lefts] + [
        box(np.array([low[0], leg]), high)]
