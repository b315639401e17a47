"use strict";

// Cells of the minimal quadtree over the boxes of the bodies, by the rule of the program (postproc/pictures.md).

const MIDDLE = 357913941, OFF_BORDER = 0.381966;

/** Bits of a number below 2^16 with a zero before each. */
function spread(bits) {
  bits = (bits | bits << 8) & 0x00ff00ff;
  bits = (bits | bits << 4) & 0x0f0f0f0f;
  bits = (bits | bits << 2) & 0x33333333;
  return (bits | bits << 1) & 0x55555555;
}

/** Finds the cells of one run, frame by frame, in the same memory. */
class CellFinder {
  constructor(run) {
    this.run = run;
    this.bodies = Uint32Array.from(run.inTree.keys()).filter((i) => run.inTree[i]);
    this.keys = new Uint32Array(this.bodies.length);
    this.sorted = new Uint32Array(this.bodies.length);
    this.column = new Int32Array(this.bodies.length);
    this.row = new Int32Array(this.bodies.length);
    this.counts = new Uint32Array(2048);
  }

  /** Cells as boxes. A node is divided if it has two boxes and is not of the finest. */
  find(list) {
    const {run, bodies, keys, column, row} = this, {grid} = run.facts;
    list.clear(0);
    if (!grid || bodies.length === 0) return;
    const boxes = run.boxes();
    let differ = 0;
    for (let k = 0; k < bodies.length; k++) {
      const b = 4 * bodies[k];
      column[k] = Math.floor((0.5 * (boxes[b] + boxes[b + 2]) - grid.origin[0]) / grid.finest + OFF_BORDER) + MIDDLE;
      row[k] = Math.floor((0.5 * (boxes[b + 1] + boxes[b + 3]) - grid.origin[1]) / grid.finest + OFF_BORDER) + MIDDLE;
      differ |= (column[k] ^ column[0]) | (row[k] ^ row[0]);
    }
    const top = differ ? 32 - Math.clz32(differ) : 0;
    if (top > 16) return;
    const lowX = column[0] >> top << top, lowY = row[0] >> top << top;
    for (let k = 0; k < bodies.length; k++) keys[k] = spread(column[k] - lowX) | spread(row[k] - lowY) << 1;
    this.sort(2 * top);
    list.clear((top + 2) * bodies.length);
    this.visit(list, 0, bodies.length, top, lowX, lowY);
  }

  /** Sort the keys, digit by digit. */
  sort(bits) {
    const {counts} = this;
    for (let shift = 0; shift < bits; shift += 11) {
      const {keys, sorted} = this;
      counts.fill(0);
      for (let k = 0; k < keys.length; k++) counts[(keys[k] >>> shift) & 2047]++;
      for (let digit = 0, before = 0; digit < 2048; digit++) {
        const count = counts[digit];
        counts[digit] = before;
        before += count;
      }
      for (let k = 0; k < keys.length; k++) sorted[counts[(keys[k] >>> shift) & 2047]++] = keys[k];
      this.keys = sorted;
      this.sorted = keys;
    }
  }

  /** Add the cell of some keys and those within it. */
  visit(list, from, to, level, x, y) {
    const {grid} = this.run.facts, [originX, originY] = this.run.origin, {data} = list, {keys} = this;
    const side = 2 ** level * grid.finest, k = 4 * list.n++;
    data[k] = (x - MIDDLE - OFF_BORDER) * grid.finest + grid.origin[0] - originX;
    data[k + 1] = (y - MIDDLE - OFF_BORDER) * grid.finest + grid.origin[1] - originY;
    data[k + 2] = data[k] + side;
    data[k + 3] = data[k + 1] + side;
    if (to - from < 2 || level === 0) return;
    const half = 1 << (level - 1), shift = 2 * (level - 1);
    for (let begin = from; begin < to;) {
      const quarter = (keys[begin] >>> shift) & 3;
      let end = begin + 1;
      while (end < to && ((keys[end] >>> shift) & 3) === quarter) end++;
      this.visit(list, begin, end, level - 1, x + (quarter & 1) * half, y + (quarter >> 1) * half);
      begin = end;
    }
  }
}

function cellBoxes(run, list) {
  run.cellFinder ??= new CellFinder(run);
  run.cellFinder.find(list);
}
