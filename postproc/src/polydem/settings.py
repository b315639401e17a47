"""Groups of a namelist, with completion and checks: {"forces": forces(friction_coefficient=0.4), ...}.

Made from the table of entries (src/config/entries.txt) by src/config/make_entries.py. Each function is a group and
returns its dictionary; an entry that is not given has its default. An unknown entry is a TypeError, a bad value an
`InputError`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, Union

import numpy.typing as npt

from .schema import made

Reals = Union[Sequence[float], npt.NDArray[Any]]
Integers = Union[Sequence[int], npt.NDArray[Any]]


def scene(
    *,
    name: Literal["drum", "hopper", "gas", "bed", "heap", "channel", "incline", "stack", "file", "result", "parts"] |
        None = None,
    start_from: str | None = None,
    bodies_file: str | None = None,
    seed: int | None = None,
    boxes: int | None = None,
    bodies: int | None = None,
    packing: str | None = None,
    corners: Integers | None = None,
    short_axis: float | None = None,
    long_axis: Reals | None = None,
    size_ratio: float | None = None,
    order: Literal["natural", "descending"] | None = None,
    remove_overlap: float | None = None,
    density: float | None = None,
    material: str | None = None,
    wall_material: str | None = None,
    radius: float | None = None,
    width: float | None = None,
    height: float | None = None,
    opening: float | None = None,
    slope: float | None = None,
    solid_fraction: float | None = None,
    overlap: bool | None = None,
    speed: float | None = None,
    spin: float | None = None,
    moving_grains: int | None = None,
) -> dict[str, Any]:
    """The group &scene.

    Bodies and walls at the start.

    name: Recipe; parts: groups &grains, &wall and `bodies_file`; file: `bodies_file`; result: `start_from`; default
        parts.
    start_from: Result folder, whose last state is the start; FOLDER:FRAME: one of its frames, from 0; -1: the last;
        required; used with name = result.
    bodies_file: HDF5 file of the bodies; required; used with name = file. HDF5 file of bodies beside those of the
        groups &grains and &wall; used with name = parts.
    seed: Seed of the random numbers; the same seed makes the same scene; default 1; >= 0; used with name = drum,
        hopper, gas, bed, heap, channel, parts.
    boxes: Number of boxes including those of walls; 0: from `bodies`; default 0; >= 0; used with name = drum.
    bodies: Number of grains; 0: from `boxes`; default 0; >= 0; used with name = drum. Number of free bodies; required;
        > 0; used with name = hopper, gas, bed, heap, channel, stack.
    packing: Result folder or file of a settled bed; copies of it fill the container; empty: loose grains; used with
        name = drum, bed.
    corners: Smallest and largest number of corners; default 7, 12; >= 3, <= 64; used with name = drum, hopper, gas,
        bed, heap, channel.
    short_axis: Short axis (full length) of the ellipse around a grain [m]; default 8e-3; >= 1e-15, <= 1e12; used with
        name = drum, hopper, gas, bed, heap, channel.
    long_axis: Smallest and largest long axis (full length) of the ellipse [m]; default 8e-3, 11e-3; >= 1e-15, <= 1e12;
        used with name = drum, hopper, gas, bed, heap, channel.
    size_ratio: Size factor (both axes) of the largest grain; each octave of sizes covers the same area; default 1; >=
        1, <= 1000; used with name = gas, bed.
    order: Numbering of the grains: as generated, or from right to left (the worst start of a sweep); default natural;
        used with name = drum, hopper, gas, bed, heap, channel.
    remove_overlap: Before time 0, bodies are pushed apart until no contact exceeds this relative depth; 0: never;
        default 0; >= 0, <= 1e6.
    density: Density of bodies without a density of their own [kg/m3]; default 2500; > 0, <= 1e30.
    material: Material of bodies without a material of their own; empty: the values of &scene and &forces.
    wall_material: Material of walls without a material of their own; empty: `material`.
    radius: Inner radius of the drum; 0: from the number of grains [m]; default 0; >= 0, <= 1e12; used with name = drum.
    width: Width of the container; 0: from the number of grains [m]; default 0; >= 0, <= 1e12; used with name = hopper,
        gas, bed. Length of the floor; 0: from the number of grains [m]; default 0; >= 0, <= 1e12; used with name =
        heap. Width of a block [m]; required; >= 1e-15, <= 1e12; used with name = incline, stack.
    height: Height of a block [m]; required; >= 1e-15, <= 1e12; used with name = incline, stack.
    opening: Width of the opening at the bottom [m]; required; > 0, <= 1e12; used with name = hopper.
    slope: Angle of the inclined walls to the horizontal [degree]; required; > 0, < 90; usually >= 1.6; used with name =
        hopper. Angle of the incline to the horizontal [degree]; required; >= 0, < 90; usually >= 1.6; used with name =
        incline.
    solid_fraction: Fraction of the area that grains cover; default 0.3; >= 1e-6, <= 100; used with name = gas, channel.
    overlap: Whether grains may overlap each other at the start; default .false.; used with name = gas.
    speed: Root mean square speed of the grains at the start [m/s]; required; >= 0, < 1e6; usually <= 300; used with
        name = gas, channel. Root mean square speed of the grains at the start [m/s]; default 0; >= 0, < 1e6; usually <=
        300; used with name = drum, hopper, bed, heap. Speed of the block down the incline at the start [m/s]; default
        0; >= 0, < 1e6; usually <= 300; used with name = incline.
    spin: Root mean square angular velocity of the grains at the start [rad/s]; default 0; >= 0, < 1e9; usually <= 2000;
        used with name = gas, channel.
    moving_grains: Number of grains that move at the start; 0: all; default 0; >= 0; used with name = gas, channel.
    """
    return made("scene", locals())


def grains(
    *,
    region: Literal["box", "disc", "polygon", "inside", "at"] | None = None,
    low: Reals | None = None,
    high: Reals | None = None,
    centre: Reals | None = None,
    radius: float | None = None,
    vertices: float | Reals | None = None,
    wall: str | None = None,
    at: Reals | None = None,
    arrangement: Literal["loose", "spread", "row", "random", "packing", "voronoi", "single", "column"] | None = None,
    number: int | None = None,
    solid_fraction: float | None = None,
    overlap: bool | None = None,
    lloyd_steps: int | None = None,
    gap: float | None = None,
    packing: str | None = None,
    shape: Literal["ellipse", "regular", "random", "rectangle", "outline", "cross"] | None = None,
    sizes: Literal["uniform", "octaves", "log_normal", "grading"] | None = None,
    corners: Integers | None = None,
    short_axis: float | None = None,
    long_axis: Reals | None = None,
    diameter: Reals | None = None,
    elongation: float | None = None,
    width: float | None = None,
    height: float | None = None,
    arm: float | None = None,
    outline: float | Reals | None = None,
    outline_corners: int | Integers | None = None,
    outline_pieces: int | Integers | None = None,
    outlines: str | None = None,
    angle: Reals | None = None,
    size_ratio: float | None = None,
    size_spread: float | None = None,
    grading: float | Reals | None = None,
    material: str | None = None,
    density: float | None = None,
    outline_choice: Literal["random", "turn"] | None = None,
    velocity: Reals | None = None,
    speed: float | None = None,
    momentum: Literal["random", "zero"] | None = None,
    moving_grains: int | None = None,
    spin: float | None = None,
    seed: int | None = None,
    order: Literal["natural", "descending"] | None = None,
) -> dict[str, Any]:
    """An instance of the group &grains.

    Free bodies that are alike, placed in the order of the file.

    region: Where the grains start; required.
    low: Lower left corner [m]; required; >= -1e12, <= 1e12; used with region = box.
    high: Upper right corner [m]; required; >= -1e12, <= 1e12; used with region = box.
    centre: Centre of the disc [m]; default 0, 0; >= -1e12, <= 1e12; used with region = disc.
    radius: Radius of the disc [m]; required; >= 1e-15, <= 1e12; used with region = disc.
    vertices: Corners x1, y1, x2, y2, ... of a convex region [m]; required; >= -1e12, <= 1e12; used with region =
        polygon.
    wall: Wall around the grains: a ring, or a closed convex polyline; required; used with region = inside.
    at: Centre of the only grain, or foot of a column [m]; required; >= -1e12, <= 1e12; used with region = at.
    arrangement: How: rows from the bottom, evenly, in a row, at random, copies of a bed, blocks that fill it; default
        loose; used with region = box, disc, polygon, inside. One grain, or a column of rectangles at rest on the wall
        below its foot; default single; used with region = at.
    number: Number of grains; 0: from `solid_fraction`; default 0; >= 0; used with region = box, disc, polygon, inside.
        Number of grains; default 1; > 0; used with region = at.
    solid_fraction: Fraction of the region that grains cover; 0: from `number`; default 0; >= 0, <= 100; used with
        region = box, disc, polygon, inside.
    overlap: Whether grains may overlap each other at the start; default .false.; used with arrangement = spread.
    lloyd_steps: Steps that make the blocks more alike; default 0; >= 0, <= 1000; used with arrangement = voronoi.
    gap: Distance of neighbouring blocks, half of it from the border; 0: from `solid_fraction` [m]; default 0; >= 0, <=
        1e12; used with arrangement = voronoi.
    packing: Result folder or file of a settled bed, copies of which fill the region; required; used with arrangement =
        packing.
    shape: Shape; ellipse: irregular, in an ellipse; random: any convex polygon; cross: three rectangles; default
        ellipse; used with arrangement = loose, spread, row, random, single, column.
    sizes: Factors of all lengths: none, octaves that cover the same area, log-normal, or a sieve curve; default
        uniform; used with arrangement = loose, spread, random.
    corners: Smallest and largest number of corners; default 7, 12; >= 3, <= 64; used with shape = ellipse, regular,
        random.
    short_axis: Short axis (full length) of the ellipse around a grain [m]; default 8e-3; >= 1e-15, <= 1e12; used with
        shape = ellipse.
    long_axis: Smallest and largest long axis (full length) of the ellipse [m]; default 8e-3, 11e-3; >= 1e-15, <= 1e12;
        used with shape = ellipse.
    diameter: Smallest and largest diameter of the circle through the corners, or length of a random polygon [m];
        required; >= 1e-15, <= 1e12; used with shape = regular, random.
    elongation: Length of a random polygon over its width; default 1; >= 1, <= 1000; used with shape = random.
    width: Width [m]; required; >= 1e-15, <= 1e12; used with shape = rectangle, cross.
    height: Height [m]; required; >= 1e-15, <= 1e12; used with shape = rectangle.
    arm: Width of the arms, less than `width` [m]; required; >= 1e-15, <= 1e12; used with shape = cross.
    outline: Corners x1, y1, x2, y2, ... relative to the place of the grain; of one polygon after the other [m]; >=
        -1e12, <= 1e12; used with shape = outline.
    outline_corners: Number of corners of each convex polygon in `outline`; empty: it is one; >= 3, <= 100000; used with
        shape = outline.
    outline_pieces: Number of these polygons of each grain shape, which may be concave; empty: 1, 1, ...; >= 1, <= 1000;
        used with shape = outline.
    outlines: Bodies file or result folder, whose free bodies have the outlines; empty: `outline`; used with shape =
        outline.
    angle: Smallest and largest angle of a grain, anticlockwise [degree]; default 0, 360; >= -360, <= 360; usually <=
        -6.4 or >= 6.4 or multiple_of 0.1; used with shape = ellipse, regular, random. Smallest and largest angle of a
        grain, anticlockwise [degree]; default 0, 0; >= -360, <= 360; usually <= -6.4 or >= 6.4 or multiple_of 0.1; used
        with shape = rectangle, outline, cross.
    size_ratio: Size factor of the largest grain; required; >= 1, <= 1000; used with sizes = octaves.
    size_spread: Geometric standard deviation of the factors, whose median is 1; required; > 1, <= 10; used with sizes =
        log_normal.
    grading: Sieve curve s1, 0, s2, p2, ..., sn, 1: fraction p by mass of grains whose factor is below s; required; >=
        0, <= 1000; used with sizes = grading.
    material: Material; empty: that of &scene.
    density: Density; 0: that of the material, or of &scene [kg/m3]; default 0; >= 0, <= 1e30.
    outline_choice: Which of several outlines a grain has: a random one, or one after the other; default random; used
        with shape = outline.
    velocity: Velocity of all grains at the start [m/s]; default 0, 0; > -1e6, < 1e6; usually >= -300, <= 300.
    speed: Root mean square of the random speeds, to which `velocity` is added [m/s]; default 0; >= 0, < 1e6; usually <=
        300.
    momentum: Momentum of the random speeds: as drawn, or zero with exactly the root mean square; default random.
    moving_grains: Number of grains that move at random; 0: all; default 0; >= 0; used with momentum = zero.
    spin: Root mean square of the random angular velocities [rad/s]; default 0; >= 0, < 1e9; usually <= 2000.
    seed: Seed of the random numbers; 0: that of &scene, plus 1 for each group before this one; default 0; >= 0.
    order: Numbering of the grains: as placed, or from right to left; default natural.
    """
    return made("grains", locals())


def wall(
    *,
    outline: Literal["line", "polyline", "rectangle", "ring", "polygon", "row", "bodies", "result"] | None = None,
    from_: Reals | None = None,
    to: Reals | None = None,
    low: Reals | None = None,
    high: Reals | None = None,
    angle: float | None = None,
    centre: Reals | None = None,
    radius: float | None = None,
    segments: int | None = None,
    corners: int | None = None,
    vertices: float | Reals | None = None,
    closed: bool | None = None,
    thickness: float | None = None,
    bodies: int | Integers | None = None,
    vanish_at: float | None = None,
    material: str | None = None,
) -> dict[str, Any]:
    """An instance of the group &wall.

    Fixed bodies that move as one; identifiers follow those of the free bodies.

    outline: What the wall is made of; result: the wall of this name in the result of `start_from`; required.
    from_: Beginning of the face; grains are on the left [m]; required; >= -1e12, <= 1e12; used with outline = line.
        Beginning of the line on which the centres are [m]; required; >= -1e12, <= 1e12; used with outline = row.
    to: End of the face [m]; required; >= -1e12, <= 1e12; used with outline = line. End of the line, half a distance
        behind the last centre [m]; required; >= -1e12, <= 1e12; used with outline = row.
    low: Lower left corner [m]; required; >= -1e12, <= 1e12; used with outline = rectangle.
    high: Upper right corner [m]; required; >= -1e12, <= 1e12; used with outline = rectangle.
    angle: Turn of the rectangle about its centre, anticlockwise [degree]; default 0; >= -360, <= 360; usually <= -6.4
        or >= 6.4 or multiple_of 0.1; used with outline = rectangle.
    centre: Centre of the ring [m]; default 0, 0; >= -1e12, <= 1e12; used with outline = ring.
    radius: Distance of the inner corners from the centre [m]; required; >= 1e-15, <= 1e12; used with outline = ring.
        Radius of the circle through the corners of a grain [m]; required; >= 1e-15, <= 1e12; used with outline = row.
    segments: Number of segments, each a body, anticlockwise from the right; required; >= 3, <= 1000000; used with
        outline = ring. Number of grains, each a body, evenly along the line; required; >= 1, <= 1000000; used with
        outline = row.
    corners: Number of corners of a grain; default 8; >= 3, <= 64; used with outline = row.
    vertices: Corners x1, y1, x2, y2, ... of the face, or of a convex polygon [m]; required; >= -1e12, <= 1e12; used
        with outline = polyline, polygon.
    closed: Whether the last corner is joined to the first; default .false.; used with outline = polyline.
    thickness: Thickness, on the right of the face and outside the ring [m]; required; >= 1e-15, <= 1e12; used with
        outline = line, polyline, ring.
    bodies: Identifiers of fixed bodies of `bodies_file` or of the result of `start_from`; required; used with outline =
        bodies.
    vanish_at: Time at which the wall vanishes; 0: never [s]; default 0; >= 0, <= 1e12.
    material: Material; empty: `wall_material` of &scene; used with outline = line, polyline, rectangle, ring, polygon,
        row.
    """
    return made("wall", locals())


def cell(
    *,
    periodic: Literal["none", "x", "y", "xy"] | None = None,
    low: Reals | None = None,
    size: Reals | None = None,
    shear_rate: float | None = None,
    shear_ramp: float | None = None,
    stress_controlled: Literal["none", "x", "y", "xy"] | None = None,
    stress: Reals | None = None,
    stress_ramp: float | None = None,
    mass: float | None = None,
    damping_ratio: float | None = None,
    stage: str | None = None,
    profile: bool | None = None,
) -> dict[str, Any]:
    """The group &cell.

    Periodic cell.

    periodic: Axes along which the scene repeats; default none.
    low: Lower left corner of the cell [m]; default 0, 0; >= -1e12, <= 1e12; used with periodic = x, y, xy.
    size: Width and height; only those along periodic axes are used [m]; required; >= 0, <= 1e12; used with periodic =
        x, y, xy.
    shear_rate: Rate at which the cell is sheared: its copy above moves along x with this rate times the height [1/s];
        default 0; > -1e9, < 1e9; usually >= -1000, <= 1000; used with periodic = xy.
    shear_ramp: Time in which the shear smoothly reaches its rate [s]; default 0; >= 0, <= 1e12; used with periodic =
        xy.
    stress_controlled: Axes along which the size of the cell follows a stress; default none; used with periodic = xy.
    stress: Prescribed stress along x and y, positive in compression [N/m2]; default 0, 0; > -1e30, < 1e30; usually <=
        -50 or >= 50; used with stress_controlled = x, y, xy.
    stress_ramp: Time in which the stress smoothly grows from zero [s]; default 0; >= 0, <= 1e12; used with
        stress_controlled = x, y, xy.
    mass: Mass of the cell; 0: that of all free bodies over the root of their number [kg/m]; default 0; >= 0, <= 1e30;
        used with stress_controlled = x, y, xy.
    damping_ratio: Damping of the size of the cell, in units of the critical one 2 sqrt(E M); default 0.1; >= 0, <= 1e6;
        usually <= 20; used with stress_controlled = x, y, xy.
    stage: Stage in which the size follows the stress; outside it the size is constant; used with stress_controlled = x,
        y, xy.
    profile: Whether bodies start with the velocity of the shear at their height (needless with shear_ramp); default
        .false.; used with periodic = xy.
    """
    return made("cell", locals())


def motion(
    *,
    kind: Literal["rotation", "translation", "oscillation", "conveyor", "table"] | None = None,
    wall: str | None = None,
    bodies: int | Integers | None = None,
    pivot: Reals | None = None,
    rate: float | None = None,
    velocity: Reals | None = None,
    amplitude: Reals | None = None,
    frequency: float | None = None,
    file: str | None = None,
    start: float | None = None,
    end: float | None = None,
    stage: str | None = None,
    ramp: float | None = None,
) -> dict[str, Any]:
    """An instance of the group &motion.

    Prescribed motion of fixed bodies.

    kind: Kind of the motion; conveyor: the surface has a velocity, the bodies stay; required.
    wall: Wall that moves.
    bodies: Identifiers of the fixed bodies that move; omitted, and no `wall`: all fixed bodies.
    pivot: Centre of the rotation [m]; default 0, 0; >= -1e12, <= 1e12; used with kind = rotation, table.
    rate: Revolutions per second, anticlockwise [1/s]; required; > -1e9, < 1e9; usually >= -10, <= 10; used with kind =
        rotation.
    velocity: Velocity of the translation, or of the surface of a conveyor [m/s]; required; > -1e6, < 1e6; usually >=
        -300, <= 300; used with kind = translation, conveyor.
    amplitude: Amplitude of the oscillation [m]; required; >= -1e12, <= 1e12; usually >= -0.3, <= 0.3; used with kind =
        oscillation.
    frequency: Frequency of the oscillation [Hz]; required; > 0, < 1e12; usually <= 5000; used with kind = oscillation.
    file: CSV file with columns time [s], x, y [m] and angle [degree]; path relative to the namelist; required; used
        with kind = table.
    start: Time at which the motion starts [s]; default 0; >= 0, <= 1e12.
    end: Time from which the bodies rest in their last pose; 0: never [s]; default 0; >= 0, <= 1e12.
    stage: Stage in which the motion acts; outside it the bodies rest where they are.
    ramp: Time in which the motion smoothly reaches full speed, and slows down before `end` [s]; default 0; >= 0, <=
        1e12; used with kind = rotation, translation, oscillation, conveyor.
    """
    return made("motion", locals())


def load(
    *,
    wall: str | None = None,
    direction: Literal["x", "y", "angle"] | None = None,
    force: float | None = None,
    stress: float | None = None,
    width: float | None = None,
    between: str | Sequence[str] | None = None,
    torque: float | None = None,
    pivot: Reals | None = None,
    mass: float | None = None,
    weight: bool | None = None,
    damping_ratio: float | None = None,
    start: float | None = None,
    end: float | None = None,
    stage: str | None = None,
    ramp: float | None = None,
) -> dict[str, Any]:
    """An instance of the group &load.

    Force on a wall, which moves along one direction by Newton's law.

    wall: Load-controlled wall; required.
    direction: Direction in which it moves: along x, along y, or a turn about `pivot`; required.
    force: Force along the direction [N/m]; default 0; > -1e30, < 1e30; used with direction = x, y.
    stress: Force per width, in place of `force`; needs `width` or `between` [N/m2]; default 0; > -1e30, < 1e30; usually
        <= -50 or >= 50; used with direction = x, y.
    width: Width on which the stress acts [m]; default 0; >= 0, <= 1e12; used with direction = x, y.
    between: Two walls; their present distance across the direction is the width for the stress; used with direction =
        x, y.
    torque: Torque about `pivot`, anticlockwise [N]; default 0; > -1e30, < 1e30; used with direction = angle.
    pivot: Centre of the turn [m]; default 0, 0; >= -1e12, <= 1e12; used with direction = angle.
    mass: Mass, spread evenly over the wall; 0: that of all free bodies over the root of their number [kg/m]; default 0;
        >= 0, <= 1e30.
    weight: Whether gravity acts on the mass, as of a lid on grains, or a flap that swings; default .false..
    damping_ratio: Damping of the wall, in units of the critical one 2 sqrt(E M); default 0.1; >= 0, <= 1e6; usually <=
        20.
    start: Time from which the load acts; before, the wall is at rest [s]; default 0; >= 0, <= 1e12.
    end: Time from which the wall rests where it is; 0: never [s]; default 0; >= 0, <= 1e12.
    stage: Stage in which the load acts; outside it the wall rests where it is.
    ramp: Time in which the force smoothly grows from zero [s]; default 0; >= 0, <= 1e12.
    """
    return made("load", locals())


def source(
    *,
    low: Reals | None = None,
    high: Reals | None = None,
    rate: float | None = None,
    count: int | None = None,
    interval: int | None = None,
    stage: str | None = None,
    velocity: Reals | None = None,
    shape: Literal["ellipse", "regular", "random", "rectangle", "outline", "cross"] | None = None,
    sizes: Literal["octaves", "log_normal", "grading"] | None = None,
    size_ratio: float | None = None,
    corners: Integers | None = None,
    short_axis: float | None = None,
    long_axis: Reals | None = None,
    diameter: Reals | None = None,
    elongation: float | None = None,
    width: float | None = None,
    height: float | None = None,
    arm: float | None = None,
    outline: float | Reals | None = None,
    outline_corners: int | Integers | None = None,
    outline_pieces: int | Integers | None = None,
    outlines: str | None = None,
    angle: Reals | None = None,
    size_spread: float | None = None,
    grading: float | Reals | None = None,
    material: str | None = None,
    density: float | None = None,
    seed: int | None = None,
) -> dict[str, Any]:
    """An instance of the group &source.

    Free bodies that enter during the run.

    low: Lower left corner of the rectangle within which bodies enter [m]; required; >= -1e12, <= 1e12.
    high: Upper right corner of this rectangle [m]; required; >= -1e12, <= 1e12.
    rate: Number of bodies that enter per second; 0: `count` decides [1/s]; default 0; >= 0, <= 1e12.
    count: Number of free bodies in the run up to which bodies enter; 0: `rate` decides; default 0; >= 0.
    interval: Steps between two times at which bodies may enter, from the start of the run; default 200; > 0.
    stage: Stage in which bodies enter; empty: in all.
    velocity: Velocity with which they enter [m/s]; default 0, 0; > -1e6, < 1e6; usually >= -300, <= 300.
    shape: Shape, as in &grains; default ellipse.
    sizes: Factors of all lengths, as in &grains; default octaves.
    size_ratio: Size factor of the largest grain; each octave of sizes covers the same area; default 1; >= 1, <= 1000;
        used with sizes = octaves.
    corners: Smallest and largest number of corners; default 7, 12; >= 3, <= 64; used with shape = ellipse, regular,
        random.
    short_axis: Short axis (full length) of the ellipse around a grain [m]; default 8e-3; >= 1e-15, <= 1e12; used with
        shape = ellipse.
    long_axis: Smallest and largest long axis (full length) of the ellipse [m]; default 8e-3, 11e-3; >= 1e-15, <= 1e12;
        used with shape = ellipse.
    diameter: Smallest and largest diameter of the circle through the corners, or length of a random polygon [m];
        required; >= 1e-15, <= 1e12; used with shape = regular, random.
    elongation: Length of a random polygon over its width; default 1; >= 1, <= 1000; used with shape = random.
    width: Width [m]; required; >= 1e-15, <= 1e12; used with shape = rectangle, cross.
    height: Height [m]; required; >= 1e-15, <= 1e12; used with shape = rectangle.
    arm: Width of the arms, less than `width` [m]; required; >= 1e-15, <= 1e12; used with shape = cross.
    outline: Corners x1, y1, x2, y2, ... relative to the place of the grain; of one polygon after the other [m]; >=
        -1e12, <= 1e12; used with shape = outline.
    outline_corners: Number of corners of each convex polygon in `outline`; empty: it is one; >= 3, <= 100000; used with
        shape = outline.
    outline_pieces: Number of these polygons of each grain shape, which may be concave; empty: 1, 1, ...; >= 1, <= 1000;
        used with shape = outline.
    outlines: Bodies file or result folder, whose free bodies have the outlines; empty: `outline`; used with shape =
        outline.
    angle: Smallest and largest angle of a grain, anticlockwise [degree]; default 0, 360; >= -360, <= 360; usually <=
        -6.4 or >= 6.4 or multiple_of 0.1; used with shape = ellipse, regular, random. Smallest and largest angle of a
        grain, anticlockwise [degree]; default 0, 0; >= -360, <= 360; usually <= -6.4 or >= 6.4 or multiple_of 0.1; used
        with shape = rectangle, outline, cross.
    size_spread: Geometric standard deviation of the factors, whose median is 1; required; > 1, <= 10; used with sizes =
        log_normal.
    grading: Sieve curve s1, 0, s2, p2, ..., sn, 1: fraction p by mass of grains whose factor is below s; required; >=
        0, <= 1000; used with sizes = grading.
    material: Material; empty: that of &scene.
    density: Density; 0: that of the material, or of &scene [kg/m3]; default 0; >= 0, <= 1e30.
    seed: Seed of the random numbers; 0: that of &scene, plus 1001 for each source; default 0; >= 0.
    """
    return made("source", locals())


def sink(
    *,
    low: Reals | None = None,
    high: Reals | None = None,
    interval: int | None = None,
    stage: str | None = None,
) -> dict[str, Any]:
    """An instance of the group &sink.

    Free bodies that leave during the run.

    low: Lower left corner of the rectangle in which bodies leave, by their centres [m]; required; >= -1e12, <= 1e12.
    high: Upper right corner of this rectangle [m]; required; >= -1e12, <= 1e12.
    interval: Steps between two times at which bodies may leave, from the start of the run; default 200; > 0.
    stage: Stage in which bodies leave; empty: in all.
    """
    return made("sink", locals())


def stage(
    *,
    until: Literal["duration", "kinetic", "unbalanced", "strain", "stress", "count", "solid_fraction", "departed"] |
        None = None,
    duration: float | None = None,
    below: float | None = None,
    above: float | None = None,
    hold: float | None = None,
    longest: float | None = None,
    at_limit: Literal["stop", "next"] | None = None,
    check: int | None = None,
    wall: str | None = None,
    opposite: str | None = None,
    sink: str | None = None,
    component: Literal["pressure", "xx", "xy", "yx", "yy"] | None = None,
    low: Reals | None = None,
    high: Reals | None = None,
    gravity: float | Reals | None = None,
    friction_scale: float | None = None,
    drag: float | None = None,
) -> dict[str, Any]:
    """An instance of the group &stage.

    Stages of the run, in the order of the file. Each one ends after a time or when a condition holds.

    until: What ends the stage: a time, or a quantity that is below or above a limit; default duration.
    duration: Simulated time of the stage [s]; required; > 0, <= 1e12; used with until = duration.
    below: The stage ends when the quantity is below this limit (SI units); 0: not used; default 0; >= 0, <= 1e30; used
        with until = kinetic, unbalanced, count, departed. The stage ends when the quantity is below this limit; 0: not
        used; default 0; >= 0, <= 1e30; usually <= 3; used with until = strain. The stage ends when the quantity is
        below this limit; 0: not used; default 0; >= 0, <= 1e30; usually <= 1.5; used with until = solid_fraction. The
        stage ends when the quantity is below this limit; 0: not used [N/m2]; default 0; >= 0, <= 1e30; usually >= 50;
        used with until = stress.
    above: The stage ends when the quantity is above this limit (SI units); 0: not used; default 0; >= 0, <= 1e30; used
        with until = kinetic, unbalanced, count, departed. The stage ends when the quantity is above this limit; 0: not
        used; default 0; >= 0, <= 1e30; usually <= 3; used with until = strain. The stage ends when the quantity is
        above this limit; 0: not used; default 0; >= 0, <= 1e30; usually <= 1.5; used with until = solid_fraction. The
        stage ends when the quantity is above this limit; 0: not used [N/m2]; default 0; >= 0, <= 1e30; usually >= 50;
        used with until = stress.
    hold: Time for which all checks must find that the condition holds [s]; default 0; >= 0, <= 1e12; used with until =
        kinetic, unbalanced, strain, stress, count, solid_fraction, departed.
    longest: Longest simulated time of the stage [s]; required; > 0, <= 1e12; used with until = kinetic, unbalanced,
        strain, stress, count, solid_fraction, departed.
    at_limit: What happens after this time: the run stops with an error, or the stage ends; default stop; used with
        until = kinetic, unbalanced, strain, stress, count, solid_fraction, departed.
    check: Steps between two checks of the condition, counted from the start of the stage; default 100; > 0; used with
        until = kinetic, unbalanced, strain, stress, count, solid_fraction, departed.
    wall: Wall whose displacement relative to `opposite` is measured; required; used with until = strain.
    opposite: Wall whose distance at the start of the stage is the length for the strain; required; used with until =
        strain.
    sink: Sink whose bodies count; empty: those of all sinks; used with until = departed.
    component: Component of the mean stress in the area of &sample; its magnitude counts; required; used with until =
        stress.
    low: Lower left corner of the rectangle of grains; omitted with `solid_fraction`: &sample, or the cell [m]; default
        0, 0; >= -1e12, <= 1e12; used with until = count, solid_fraction.
    high: Upper right corner of this rectangle [m]; default 0, 0; >= -1e12, <= 1e12; used with until = count,
        solid_fraction.
    gravity: Acceleration of gravity, two numbers; omitted: that of &forces [m/s2]; > -1e12, < 1e12; usually >= -5000,
        <= 5000 / >= -5000, <= 0.
    friction_scale: Factor of the friction coefficients; default 1; >= 0, <= 1000.
    drag: Drag in addition to that of &forces [1/s]; default 0; >= 0, <= 1e12.
    """
    return made("stage", locals())


def sample(
    *,
    area: Literal["none", "rectangle", "walls"] | None = None,
    low: Reals | None = None,
    high: Reals | None = None,
    sides: str | Sequence[str] | None = None,
    ends: str | Sequence[str] | None = None,
) -> dict[str, Any]:
    """The group &sample.

    Area of the sample, over which stress, solid fraction and inertial number are averaged.

    area: The area; none: no averages, or those of a cell that is periodic along x and y; default none.
    low: Lower left corner [m]; required; >= -1e12, <= 1e12; used with area = rectangle.
    high: Upper right corner [m]; required; >= -1e12, <= 1e12; used with area = rectangle.
    sides: The two walls that bound it along x; omitted in a cell that is periodic along x; used with area = walls.
    ends: The two walls that bound it along y; omitted in a cell that is periodic along y; used with area = walls.
    """
    return made("sample", locals())


def boxes(
    *,
    largest_ratio: float | None = None,
    margin: float | None = None,
) -> dict[str, Any]:
    """The group &boxes.

    largest_ratio: A body longer than this many median diameters gets several boxes; default 4; >= 1.
    margin: Enlargement of every box on each side, for interactions at a distance [m]; default 0; >= 0, <= 1e12.
    """
    return made("boxes", locals())


def neighbours(
    *,
    finder: Literal["all_pairs", "sort_and_sweep", "unsorted_sweep", "partitioned_sweep", "quadtree",
        "filtered_quadtree", "pruned_quadtree", "binary_tree", "linked_cells", "verlet", "two_level",
        "hierarchical_grid"] | None = None,
    skin: float | None = None,
) -> dict[str, Any]:
    """The group &neighbours.

    finder: Method that finds pairs of overlapping boxes; default two_level.
    skin: Approach of two boxes that triggers a rebuild of the Verlet list; 0: set from counted cost [m]; default 0; >=
        0, <= 1e12; used with finder = verlet.
    """
    return made("neighbours", locals())


def overlap(
    *,
    degenerate: Literal["push", "stop"] | None = None,
) -> dict[str, Any]:
    """The group &overlap.

    degenerate: Contact without direction: push apart along the line of centres, or stop the run; default push.
    """
    return made("overlap", locals())


def forces(
    *,
    gravity: Reals | None = None,
    stiffness: float | None = None,
    stiffness_over_pressure: float | None = None,
    law: Literal["area", "conservative", "polar"] | None = None,
    cohesion: float | None = None,
    damping: Literal["rate", "hunt_crossley", "matuttis_chen", "none"] | None = None,
    restitution: float | None = None,
    damping_coefficient: float | None = None,
    damping_from_touch: bool | None = None,
    tilt_damping: float | None = None,
    friction: Literal["cundall_strack", "exact", "none"] | None = None,
    friction_coefficient: float | None = None,
    tangential_stiffness: float | None = None,
    tangential_damping: float | None = None,
    midstep_slip: bool | None = None,
    rolling_friction: float | None = None,
    rolling_damping: float | None = None,
    drag: float | None = None,
    local_damping: float | None = None,
    shake: Reals | None = None,
    shake_frequency: float | None = None,
    turn_rate: float | None = None,
    friction_tolerance: float | None = None,
) -> dict[str, Any]:
    """The group &forces.

    gravity: Acceleration of gravity [m/s2]; default 0, -9.81; > -1e12, < 1e12; usually >= -5000, <= 5000 / >= -5000, <=
        0.
    stiffness: Young's modulus E in two dimensions; `./polydem accuracy` tells how stiff is enough [N/m2]; default 1e7;
        > 0, <= 1e30.
    stiffness_over_pressure: E over the greatest static pressure at the start (weight, loads, cell), in place of
        `stiffness`; > 0, <= 1e30.
    law: Elastic force: from an energy, by default E A^2/(2 L^2), or E A/l (Matuttis & Chen); default polar.
    cohesion: Cohesion: traction along the line of a contact [N/m2]; default 0; >= 0, <= 1e30.
    damping: Normal damping: rate of the area, that rate times elastic force, Matuttis & Chen, or none; default rate.
    restitution: Restitution of an impact; 0.01 to 1, not used if `damping_coefficient` is given; default 0.5; >= 0, <=
        1; used with damping = rate.
    damping_coefficient: Damping coefficient gamma; in place of `restitution`, a few hundred with hunt_crossley; default
        0.0251; >= 0, <= 1e6; used with damping = rate, hunt_crossley, matuttis_chen.
    damping_from_touch: Whether damping starts at first touch within the step (restitution of second order in dt);
        default .true.; used with damping = rate.
    tilt_damping: Torque of normal damping against tilts; 1: of an even bed of dashpots along the contact; 0: none;
        default 1; >= 0, <= 1e6; used with damping = rate, hunt_crossley, matuttis_chen.
    friction: Friction: tangential spring, exact without spring (needs `scheme` velocity_verlet), or none; default
        cundall_strack.
    friction_coefficient: Friction coefficient mu; default 0.23; >= 0, <= 1e12; usually <= 5 or > 90; used with friction
        = cundall_strack, exact.
    tangential_stiffness: Tangential stiffness in units of E; default 0.2857142857142857; > 0, <= 1e6; usually <= 10;
        used with friction = cundall_strack.
    tangential_damping: Tangential damping in units of sqrt(k_t m_t); default 0.25; >= 0, <= 1e6; used with friction =
        cundall_strack.
    midstep_slip: Whether friction uses the slip velocity at mid-step (friction of second order in dt); default .true.;
        used with friction = cundall_strack.
    rolling_friction: Coefficient mu_r of the couple against rolling; for rounded grains, 0: none; default 0; >= 0, <=
        10; usually <= 2.
    rolling_damping: Dashpot of that couple as a share of the critical one; default 0.3; >= 0, <= 1e6; usually <= 20.
    drag: Drag of a medium at rest: force -drag m v and torque -drag I omega on free bodies [1/s]; default 0; >= 0, <=
        1e12.
    local_damping: Share of the total force on a free body that acts against its velocity; damps quasi-static flow;
        default 0; >= 0, < 1.
    shake: Amplitude of an acceleration of all free bodies, times sin(2 pi `shake_frequency` t) [m/s2]; default 0, 0; >
        -1e12, < 1e12; usually >= -5000, <= 5000.
    shake_frequency: Frequency of this acceleration [1/s]; default 0; >= 0, < 1e9; usually <= 5000.
    turn_rate: Revolutions of gravity per second, anticlockwise from its direction at time 0 [1/s]; default 0; > -1e9, <
        1e9; usually >= -10, <= 10.
    friction_tolerance: Slip left at sticking contacts, relative to the largest slip velocity removed in a step; default
        1e-10; > 0, <= 1e-3; used with friction = exact.
    """
    return made("forces", locals())


def material(
    *,
    density: float | None = None,
    stiffness: float | None = None,
    cohesion: float | None = None,
    restitution: float | None = None,
    damping_coefficient: float | None = None,
    friction_coefficient: float | None = None,
    tangential_stiffness: float | None = None,
    rolling_friction: float | None = None,
) -> dict[str, Any]:
    """An instance of the group &material.

    What bodies consist of. Numbers that are not given are those of &scene (density) and &forces.

    density: Density [kg/m3]; > 0, <= 1e30.
    stiffness: Young's modulus E in two dimensions; of two materials: harmonic mean [N/m2]; > 0, <= 1e30.
    cohesion: Cohesion: traction along the line of a contact; of two materials: geometric mean [N/m2]; >= 0, <= 1e30.
    restitution: Restitution of an impact; of two materials: smaller one; >= 0, <= 1.
    damping_coefficient: Damping coefficient gamma; of two materials: mean; >= 0, <= 1e6.
    friction_coefficient: Friction coefficient mu; of two materials: smaller one; >= 0, <= 1e12; usually <= 5 or > 90.
    tangential_stiffness: Tangential stiffness in units of E; of two materials: mean; > 0, <= 1e6; usually <= 10.
    rolling_friction: Coefficient mu_r of the couple against rolling; of two materials: smaller one; >= 0, <= 10;
        usually <= 2.
    """
    return made("material", locals())


def contact_pair(
    *,
    materials: Sequence[str] | None = None,
    stiffness: float | None = None,
    cohesion: float | None = None,
    restitution: float | None = None,
    damping_coefficient: float | None = None,
    friction_coefficient: float | None = None,
    tangential_stiffness: float | None = None,
    rolling_friction: float | None = None,
) -> dict[str, Any]:
    """An instance of the group &contact_pair.

    Contacts of two materials. Numbers that are not given are mixed from those of the materials.

    materials: The two materials, or one material twice; required.
    stiffness: Young's modulus E in two dimensions [N/m2]; > 0, <= 1e30.
    cohesion: Cohesion: traction along the line of a contact [N/m2]; >= 0, <= 1e30.
    restitution: Restitution of an impact; >= 0, <= 1.
    damping_coefficient: Damping coefficient gamma; >= 0, <= 1e6.
    friction_coefficient: Friction coefficient mu; >= 0, <= 1e12; usually <= 5 or > 90.
    tangential_stiffness: Tangential stiffness in units of E; > 0, <= 1e6; usually <= 10.
    rolling_friction: Coefficient mu_r of the couple against rolling; >= 0, <= 10; usually <= 2.
    """
    return made("contact_pair", locals())


def guards(
    *,
    displacement: Literal["stop", "warn", "off"] | None = None,
    displacement_limit: float | None = None,
    step: Literal["stop", "warn", "off"] | None = None,
    overlap: Literal["stop", "warn", "off"] | None = None,
    overlap_limit: float | None = None,
    tunnelling: Literal["stop", "warn", "off"] | None = None,
    energy: Literal["stop", "warn", "off"] | None = None,
    energy_limit: float | None = None,
    listed_depth: float | None = None,
) -> dict[str, Any]:
    """The group &guards.

    Monitors of a run. Each one stops the run ('stop'), warns ('warn') or is 'off'.

    displacement: Monitor of bodies that move so far in a step that they could pass through another body; default stop.
    displacement_limit: Largest displacement of a point in a step, relative to the thinnest body; default 0.25; > 0, <=
        1e6; used with displacement = stop, warn.
    step: Monitor of time steps above the stable time step of the contacts; above half of it: a warning; default stop.
    overlap: Monitor of contacts that are deep relative to their bodies; default warn.
    overlap_limit: Largest depth (area over length) of a contact, relative to the thinner body; default 0.25; > 0, <=
        1e6; used with overlap = stop, warn.
    tunnelling: Monitor of centres inside other bodies and of contacts whose direction reverses in a step; default warn.
    energy: Monitor of unexplained energy gain, every 100 steps; needs `energy_balance` in &output; default off.
    energy_limit: Largest unexplained energy gain, relative to the largest kinetic energy or work so far; default 0.1; >
        0, <= 1e6; used with energy = stop, warn.
    listed_depth: Initial contacts deeper than this fraction of the thinner body are listed individually; default 1e-3;
        >= 0, <= 1e6.
    """
    return made("guards", locals())


def integrate(
    *,
    scheme: Literal["velocity_verlet", "gear", "gear_3_20"] | None = None,
    accumulation: Literal["plain", "compensated"] | None = None,
    dt: float | None = None,
    safety_factor: float | None = None,
    speed: float | None = None,
    duration: float | None = None,
) -> dict[str, Any]:
    """The group &integrate.

    scheme: Integration scheme; gear: position coefficient 3/16; gear_3_20: 3/20, for forces of positions only; default
        velocity_verlet.
    accumulation: Summation of positions and velocities over the steps: plain, or compensated for rounding errors;
        default plain; used with scheme = velocity_verlet.
    dt: Time step; 0: `safety_factor` times the stable time step [s]; default 0; >= 0, <= 1e12.
    safety_factor: Time step over stable time step if `dt` is 0; default 0.3; >= 1e-9, <= 1000.
    speed: Speed at which bodies meet, for which `dt` is chosen if it is 0; 0: estimated from the scene [m/s]; default
        0; >= 0, < 1e6; usually <= 300.
    duration: Simulated time; not used with groups &stage [s]; required; > 0, <= 1e12.
    """
    return made("integrate", locals())


def decomposition(
    *,
    margin: float | None = None,
    balance: Literal["measured", "counted", "off"] | None = None,
    imbalance: float | None = None,
) -> dict[str, Any]:
    """The group &decomposition.

    Distribution of the bodies over ranks. It does not affect results.

    margin: Distance that bodies near other ranks may move before a redistribution; 0: adapted to its cost [m]; default
        0; >= 0, <= 1e12.
    balance: Work balanced over ranks: measured times, counted pairs, or off (partition of the start); default measured.
    imbalance: Ratio of largest to mean work of a rank above which space is partitioned again; default 1.1; >= 1, <=
        1e6; used with balance = measured, counted.
    """
    return made("decomposition", locals())


def output(
    *,
    folder: str | None = None,
    frame_interval: float | None = None,
    frames_per_segment: int | None = None,
    log_interval: float | None = None,
    contacts: bool | None = None,
    energy_balance: bool | None = None,
    body_works: bool | None = None,
    series_interval: float | None = None,
    csv: bool | None = None,
    trace_steps: int | None = None,
    trace_start: float | None = None,
    step_profile: bool | None = None,
) -> dict[str, Any]:
    """The group &output.

    folder: Result folder; empty: results/ and the name of the namelist file.
    frame_interval: Simulated time between two frames, at the nearest steps; 0: the first and the last frame only [s];
        default 0; >= 0.
    frames_per_segment: Number of frames in a trajectory segment (one file); 0: 20 to 200, the more the fewer the
        bodies; default 0; >= 0.
    log_interval: Simulated time between two lines of the log; 0: twenty lines in total [s]; default 0; >= 0.
    contacts: Whether frames contain the contacts; default .false..
    energy_balance: Whether the energy and momentum balance is computed; default .true..
    body_works: Whether frames contain the works of damping and friction on each body; default .false..
    series_interval: Simulated time between two rows of the series, at nearest steps; 0: no series [s]; default 0; >= 0.
    csv: Whether the run writes the series to series.csv at its end; default .false..
    trace_steps: Number of steps whose boxes are recorded in trace.h5; default 0; >= 0.
    trace_start: Simulated time at which the recording of boxes starts [s]; default 0; >= 0, <= 1e12.
    step_profile: Whether steps.h5 contains the times and counts of every step; default .false..
    """
    return made("output", locals())


def checkpoint(
    *,
    steps: int | None = None,
    interval: float | None = None,
    wall_interval: float | None = None,
    at_end: bool | None = None,
) -> dict[str, Any]:
    """The group &checkpoint.

    steps: Steps between two checkpoints, from which a run can restart; 0: not by steps; default 0; >= 0.
    interval: Simulated time between two checkpoints; 0: not by simulated time [s]; default 0; >= 0.
    wall_interval: Elapsed time between two checkpoints; 0: not by elapsed time [s]; default 600; >= 0.
    at_end: Whether a run writes a checkpoint at its end, from which it can be made longer; default .true..
    """
    return made("checkpoint", locals())
