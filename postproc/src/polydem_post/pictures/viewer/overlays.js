"use strict";

// What is laid over the bodies, as texels of four numbers. A segment has two texels: x and y of an end relative to the
// origin, and the width [m]. A box has one: x and y of two corners.

/** Texels in one row of a texture. */
const ROW = 2048;

/** A growing list of texels in whole rows. */
class Texels {
  constructor() {
    this.n = 0;
    this.data = new Float32Array(4 * ROW);
  }

  /** Empty it, and make room: for the fullest frame, since it costs more than to fill it. */
  clear(most) {
    this.n = 0;
    if (4 * most > this.data.length) this.data = new Float32Array(4 * ROW * Math.ceil(1.25 * most / ROW));
  }
}

/** Width of the line of the force that has the widest [m]. */
function widestForce(run) { return 0.45 * run.facts.size; }

/** Lines from the centres of two bodies to their contact point, as wide as the force; to a wall none. */
function forceSegments(run, list) {
  const t = run.contacts(), widest = widestForce(run), least = 0.002 * widest;
  const factor = widest / run.facts.contacts.covered;
  const {state, fixed} = run;
  list.clear(4 * t.most);
  const {data} = list;
  let k = 0;
  for (let c = 0; c < t.n; c++) {
    const width = Math.min(t.size[c] * factor, widest);
    if (width < least) continue;
    for (let side = 0; side < 2; side++) {
      const i = side === 0 ? t.first[c] : t.second[c];
      if (fixed[i]) continue;
      data[k] = state[4 * i];
      data[k + 1] = state[4 * i + 1];
      data[k + 2] = width;
      const [across, up] = run.arm(i, t.x[c], t.y[c]);
      data[k + 4] = state[4 * i] + across;
      data[k + 5] = state[4 * i + 1] + up;
      k += 8;
    }
  }
  list.n = k / 4;
}

/** A square at each contact point. */
function contactSegments(run, list) {
  const t = run.contacts(), half = 0.05 * run.facts.size, [originX, originY] = run.origin;
  list.clear(2 * t.most);
  const {data} = list;
  for (let c = 0, k = 0; c < t.n; c++, k += 8) {
    data[k] = t.x[c] - originX - half;
    data[k + 4] = t.x[c] - originX + half;
    data[k + 1] = data[k + 5] = t.y[c] - originY;
    data[k + 2] = 2 * half;
  }
  list.n = 2 * t.n;
}

function bodyBoxes(run, list) {
  const boxes = run.boxes(), [originX, originY] = run.origin;
  list.clear(run.n);
  const {data} = list;
  let k = 0;
  for (let i = 0; i < run.n; i++) {
    if (run.fixed[i]) continue;
    data[k] = boxes[4 * i] - originX;
    data[k + 1] = boxes[4 * i + 1] - originY;
    data[k + 2] = boxes[4 * i + 2] - originX;
    data[k + 3] = boxes[4 * i + 3] - originY;
    k += 4;
  }
  list.n = k / 4;
}

/** The border of the periodic cell, in lines of a width [m]. */
function cellSegments(run, list, width) {
  const [originX, originY] = run.origin, lines = run.cellLines();
  list.clear(2 * lines.length);
  lines.forEach(([x0, y0, x1, y1], k) => {
    list.data.set([x0 - originX, y0 - originY, width, 0, x1 - originX, y1 - originY, 0, 0], 8 * k);
  });
  list.n = 2 * lines.length;
}

/** Name of an overlay -> what makes it, of which shapes, and its colour; those of pictures (drawing.py). */
const OVERLAYS = {
  cells: {make: cellBoxes, shapes: "boxes", colour: [0.478, 0.239, 0.722]},
  boxes: {make: bodyBoxes, shapes: "boxes", colour: [0, 0.447, 0.698]},
  forces: {make: forceSegments, shapes: "segments", colour: [0.627, 0.063, 0.125]},
  contacts: {make: contactSegments, shapes: "segments", colour: [0.835, 0.369, 0]},
};
