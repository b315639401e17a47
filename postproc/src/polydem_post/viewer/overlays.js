"use strict";

// What is laid over the bodies: segments, as x and y of both ends relative to an origin and a width [m], and boxes, as x
// and y of two corners.

/** A growing list of segments (5 numbers each) or boxes (4). */
class Shapes {
  constructor(numbers, originX, originY) {
    this.n = 0;
    this.numbers = numbers;
    this.data = new Float32Array(numbers * 1024);
    this.originX = originX;
    this.originY = originY;
  }

  clear() { this.n = 0; }

  reserve(more) {
    const needed = this.numbers * (this.n + more);
    if (needed <= this.data.length) return;
    const larger = new Float32Array(Math.max(needed, 2 * this.data.length));
    larger.set(this.data);
    this.data = larger;
  }

  /** Add one; there must be room. */
  add(ax, ay, bx, by, width) {
    const k = this.numbers * this.n++, data = this.data;
    data[k] = ax - this.originX;
    data[k + 1] = ay - this.originY;
    data[k + 2] = bx - this.originX;
    data[k + 3] = by - this.originY;
    if (this.numbers === 5) data[k + 4] = width;
  }
}

/** Width of the line of the force that has the widest [m]. */
function widestForce(run) { return 0.45 * run.facts.diameter; }

/** Lines from the centres of two bodies to their contact point, as wide as the force; to a wall none. */
function forceSegments(run, segments) {
  const t = run.contacts, widest = widestForce(run), covered = run.facts.contacts.covered;
  segments.reserve(2 * t.n);
  for (let c = 0; c < t.n; c++) {
    const width = widest * Math.min(t.size[c] / covered, 1);
    if (width < 0.002 * widest) continue;
    for (const i of [t.first[c], t.second[c]]) {
      if (!run.fixed[i]) segments.add(run.x[i], run.y[i], t.x[c], t.y[c], width);
    }
  }
}

/** A square at each contact point. */
function contactSegments(run, segments) {
  const t = run.contacts, half = 0.05 * run.facts.diameter;
  segments.reserve(t.n);
  for (let c = 0; c < t.n; c++) segments.add(t.x[c] - half, t.y[c], t.x[c] + half, t.y[c], 2 * half);
}

function bodyBoxes(run, list) {
  const boxes = run.boxes();
  list.reserve(run.n);
  for (let i = 0; i < run.n; i++) {
    if (!run.fixed[i]) list.add(boxes[4 * i], boxes[4 * i + 1], boxes[4 * i + 2], boxes[4 * i + 3]);
  }
}

function cellBoxes(run, list) {
  const cells = treeCells(run);
  list.reserve(cells.n);
  for (let k = 0; k < cells.n; k++) {
    const x = cells.data[3 * k], y = cells.data[3 * k + 1], side = cells.data[3 * k + 2];
    list.add(x, y, x + side, y + side);
  }
}

/** Name of an overlay -> what makes it, of which shapes, and its colour; those of pictures (drawing.py). */
const OVERLAYS = {
  cells: {make: cellBoxes, shapes: "boxes", colour: [0.478, 0.239, 0.722]},
  boxes: {make: bodyBoxes, shapes: "boxes", colour: [0, 0.447, 0.698]},
  forces: {make: forceSegments, shapes: "segments", colour: [0.627, 0.063, 0.125]},
  contacts: {make: contactSegments, shapes: "segments", colour: [0.835, 0.369, 0]},
};
