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

/** Cells as x, y and side of each, with their number. A node is divided if it has two boxes and is not of the finest. */
function treeCells(run) {
  const grid = run.facts.grid, boxes = run.boxes(), ax = new Int32Array(run.n), ay = new Int32Array(run.n);
  if (!grid) return {n: 0, data: new Float64Array(0)};
  let count = 0;
  for (let i = 0; i < run.n; i++) {
    if (!run.inTree[i]) continue;
    ax[count] = Math.floor((0.5 * (boxes[4 * i] + boxes[4 * i + 2]) - grid.origin[0]) / grid.finest + OFF_BORDER) + MIDDLE;
    ay[count++] = Math.floor((0.5 * (boxes[4 * i + 1] + boxes[4 * i + 3]) - grid.origin[1]) / grid.finest + OFF_BORDER) + MIDDLE;
  }
  let differ = 0;
  for (let k = 0; k < count; k++) differ |= (ax[k] ^ ax[0]) | (ay[k] ^ ay[0]);
  const top = differ ? 32 - Math.clz32(differ) : 0;
  if (top > 16) return {n: 0, data: new Float64Array(0)};
  const lowX = ax[0] >> top << top, lowY = ay[0] >> top << top;
  const keys = new Uint32Array(count);
  for (let k = 0; k < count; k++) keys[k] = (spread(ax[k] - lowX) | spread(ay[k] - lowY) << 1) >>> 0;
  keys.sort();
  const data = new Float64Array(3 * (top + 2) * Math.max(keys.length, 1));
  let n = 0;
  const visit = (from, to, level, x, y) => {
    data[3 * n] = (x - MIDDLE - OFF_BORDER) * grid.finest + grid.origin[0];
    data[3 * n + 1] = (y - MIDDLE - OFF_BORDER) * grid.finest + grid.origin[1];
    data[3 * n++ + 2] = Math.pow(2, level) * grid.finest;
    if (to - from < 2 || level === 0) return;
    const half = 1 << (level - 1), shift = 2 * (level - 1);
    for (let begin = from; begin < to;) {
      const quarter = (keys[begin] >>> shift) & 3;
      let end = begin + 1;
      while (end < to && ((keys[end] >>> shift) & 3) === quarter) end++;
      visit(begin, end, level - 1, x + (quarter & 1) * half, y + (quarter >> 1) * half);
      begin = end;
    }
  };
  visit(0, keys.length, top, lowX, lowY);
  return {n, data};
}
