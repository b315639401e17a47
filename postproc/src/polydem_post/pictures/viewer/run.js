"use strict";

/** A run in memory: bodies, and their positions, angles, velocities and contacts in every frame. */
class Run {
  static async read() {
    const run = new Run();
    run.facts = JSON.parse(document.getElementById("facts").textContent);
    const facts = run.facts;
    run.frames = facts.times.length;
    run.n = facts.bodies;
    run.shape = await readArray("shape", Float32Array);
    run.start = await readArray("start", Uint32Array);
    run.id = await readArray("id", Int32Array);
    run.fixed = await readArray("fixed", Uint8Array);
    run.mass = await readArray("mass", Float32Array);
    run.material = await readArray("material", Int32Array);
    run.inTree = await readArray("in_tree", Uint8Array);
    run.series = {};
    for (const [name, fact] of Object.entries(facts.series)) {
      run.series[name] = {quantum: fact.quantum, values: await readSeries(name, fact, run.frames, run.n)};
    }
    run.area = run.areas();
    run.spans = run.spanning();
    if (facts.contacts) await run.readContacts();
    const [x0, y0, x1, y1] = facts.limits;
    /** Middle of what is shown [m]; single precision is only used relative to it. */
    run.origin = [0.5 * (x0 + x1), 0.5 * (y0 + y1)];
    run.x = new Float64Array(run.n);
    run.y = new Float64Array(run.n);
    /** Of each body: x and y relative to the origin, cosine and sine of the angle; whole rows of a texture. */
    run.state = new Float32Array(4 * ROW * Math.max(1, Math.ceil(run.n / ROW)));
    run.bounds = new Float64Array(4 * run.n);
    run.go(0);
    return run;
  }

  async readContacts() {
    const facts = this.facts.contacts;
    this.pairFirst = await readArray("pair_first", Uint32Array);
    this.pairSecond = await readArray("pair_second", Uint32Array);
    this.armX = await readArray("arm_x", Int8Array);
    this.armY = await readArray("arm_y", Int8Array);
    this.forceRoot = await readArray("force", Uint8Array);
    this.direction = await readArray("direction", Uint8Array);
    const changed = await readBlock("present");
    const bytes = Math.ceil(facts.pairs / 8);
    const present = new Uint8Array(bytes);
    this.contactStart = new Uint32Array(this.frames + 1);
    facts.count.forEach((count, k) => { this.contactStart[k + 1] = this.contactStart[k] + count; });
    this.contactPair = new Uint32Array(this.contactStart[this.frames]);
    let c = 0;
    for (let k = 0; k < this.frames; k++) {
      for (let b = 0; b < bytes; b++) {
        present[b] ^= changed[k * bytes + b];
        for (let bits = present[b]; bits; bits &= bits - 1) {
          this.contactPair[c++] = 8 * b + 31 - Math.clz32(bits & -bits);
        }
      }
    }
    this.cosines = Float64Array.from({length: 256}, (_, k) => Math.cos(2 * Math.PI * k / 256));
    this.sines = Float64Array.from({length: 256}, (_, k) => Math.sin(2 * Math.PI * k / 256));
    const most = facts.count.reduce((a, b) => Math.max(a, b), 0), numbers = () => new Float64Array(most);
    this.table = {n: 0, most, frame: -1, first: new Uint32Array(most), second: new Uint32Array(most),
      x: numbers(), y: numbers(), fx: numbers(), fy: numbers(), size: numbers()};
    const sums = () => new Float64Array(this.n);
    this.sums = {frame: -1, fx: sums(), fy: sums(), load: sums(), count: sums(), xx: sums(), yy: sums(), xy: sums()};
  }

  /** Whether a body is a fixed one about as long as the periodic cell, without copies, as in `spans` of frames.py. */
  spanning() {
    const spans = new Uint8Array(this.n), [, , width, height] = this.facts.cells ? this.facts.cells[0] : [0, 0, 0, 0];
    const least = Math.min(width || Infinity, height || Infinity);
    for (let i = 0; i < this.n; i++) {
      for (let v = 2 * this.start[i]; this.fixed[i] && v < 2 * this.start[i + 1]; v += 2) {
        if (4 * Math.max(Math.abs(this.shape[v]), Math.abs(this.shape[v + 1])) >= least) spans[i] = 1;
      }
    }
    return spans;
  }

  /** Vector from a body to a point, in a periodic cell to its nearest copy. */
  arm(i, x, y) {
    let dx = x - this.x[i], dy = y - this.y[i];
    if (!this.facts.cells || this.spans[i]) return [dx, dy];
    const [, , width, height, shift] = this.facts.cells[this.frame];
    if (height) {
      const copies = Math.round(dy / height);
      dx -= copies * shift;
      dy -= copies * height;
    }
    if (width) dx -= Math.round(dx / width) * width;
    return [dx, dy];
  }

  /** Ends of the lines of the border of the periodic cell, as in `cell_lines` of drawing.py: [x, y, x, y] each. */
  cellLines() {
    if (!this.facts.cells) return [];
    const [x0, y0, width, height, shift] = this.facts.cells[this.frame], [left, bottom, right, top] = this.facts.limits;
    const [low, high] = height ? [y0, y0 + height] : [2 * bottom - top, 2 * top - bottom];
    const [from, to] = width ? [x0, x0 + width] : [2 * left - right, 2 * right - left];
    const lines = [];
    if (width) lines.push([from, low, from, high], [to, low, to, high]);
    if (height) lines.push([from, low, to, low], [from, high, to, high]);
    const stub = 0.02 * Math.max(width, height);
    if (shift) lines.push([from + shift, high, from + shift, high + stub], [to - shift, low, to - shift, low - stub]);
    return lines;
  }

  areas() {
    const area = new Float64Array(this.n);
    for (let i = 0; i < this.n; i++) {
      for (let a = this.start[i], b = this.start[i + 1] - 1; a < this.start[i + 1]; b = a++) {
        area[i] += 0.5 * (this.shape[2 * b] * this.shape[2 * a + 1] - this.shape[2 * b + 1] * this.shape[2 * a]);
      }
    }
    return area;
  }

  /** Value of a series for a body in the present frame. */
  value(series, i) { return series.values[this.frame * this.n + i] * series.quantum; }

  /** Make a frame the present one. What depends on it is found when it is asked for. */
  go(frame) {
    this.frame = frame;
    this.hasBounds = false;
    const {x, y, state} = this, {x: seriesX, y: seriesY, angle} = this.series, [originX, originY] = this.origin;
    for (let i = 0, k = frame * this.n; i < this.n; i++, k++) {
      x[i] = seriesX.values[k] * seriesX.quantum;
      y[i] = seriesY.values[k] * seriesY.quantum;
      const turned = angle.values[k] * angle.quantum;
      state[4 * i] = x[i] - originX;
      state[4 * i + 1] = y[i] - originY;
      state[4 * i + 2] = Math.cos(turned);
      state[4 * i + 3] = Math.sin(turned);
    }
  }

  /** Contacts of the present frame: indices of bodies, points, forces on the first body and their magnitudes. */
  contacts() {
    const {table, pairFirst, pairSecond, fixed, cosines, sines} = this;
    if (table.frame === this.frame) return table;
    const facts = this.facts.contacts, from = this.contactStart[this.frame], arm = facts.reach / 127;
    const {first, second, x, y, fx, fy, size} = table;
    table.frame = this.frame;
    table.n = this.contactStart[this.frame + 1] - from;
    for (let c = 0, k = from; c < table.n; c++, k++) {
      const pair = this.contactPair[k], base = fixed[pairFirst[pair]] ? pairSecond[pair] : pairFirst[pair];
      const root = this.forceRoot[k] / 255;
      first[c] = pairFirst[pair];
      second[c] = pairSecond[pair];
      x[c] = this.x[base] + arm * this.armX[k];
      y[c] = this.y[base] + arm * this.armY[k];
      size[c] = facts.greatest * root * root;
      fx[c] = size[c] * cosines[this.direction[k]];
      fy[c] = size[c] * sines[this.direction[k]];
    }
    return table;
  }

  /**
   * Sums over the contacts of each body in the present frame: force, magnitudes of forces, number of bodies that it
   * touches, and the symmetric part of arm times force.
   */
  contactSums() {
    const {sums} = this;
    if (sums.frame === this.frame) return sums;
    const t = this.contacts(), {fx, fy, load, count, xx, yy, xy} = sums;
    sums.frame = this.frame;
    for (const sum of [fx, fy, load, count, xx, yy, xy]) sum.fill(0);
    for (let c = 0; c < t.n; c++) {
      // Contacts of the same two bodies follow each other.
      const another = !c || t.first[c] !== t.first[c - 1] || t.second[c] !== t.second[c - 1] ? 1 : 0;
      for (let sign = 1; sign >= -1; sign -= 2) {
        const i = sign > 0 ? t.first[c] : t.second[c];
        const x = sign * t.fx[c], y = sign * t.fy[c], [rx, ry] = this.arm(i, t.x[c], t.y[c]);
        fx[i] += x;
        fy[i] += y;
        load[i] += t.size[c];
        count[i] += another;
        xx[i] += rx * x;
        yy[i] += ry * y;
        xy[i] += 0.5 * (rx * y + ry * x);
      }
    }
    return sums;
  }

  /** Bounding boxes of the bodies in the present frame: xmin, ymin, xmax, ymax of each. */
  boxes() {
    if (this.hasBounds) return this.bounds;
    const {shape, start, bounds, state} = this;
    for (let i = 0; i < this.n; i++) {
      const c = state[4 * i + 2], s = state[4 * i + 3], end = 2 * start[i + 1];
      let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
      for (let v = 2 * start[i]; v < end; v += 2) {
        const x = c * shape[v] - s * shape[v + 1], y = s * shape[v] + c * shape[v + 1];
        if (x < x0) x0 = x;
        if (x > x1) x1 = x;
        if (y < y0) y0 = y;
        if (y > y1) y1 = y;
      }
      bounds[4 * i] = this.x[i] + x0;
      bounds[4 * i + 1] = this.y[i] + y0;
      bounds[4 * i + 2] = this.x[i] + x1;
      bounds[4 * i + 3] = this.y[i] + y1;
    }
    this.hasBounds = true;
    return bounds;
  }

  /** The body at a point, the last if several are; -1 if there is none. */
  bodyAt(px, py) {
    for (let i = this.n - 1; i >= 0; i--) {
      const dx = px - this.x[i], dy = py - this.y[i], cosine = this.state[4 * i + 2], sine = this.state[4 * i + 3];
      const x = cosine * dx + sine * dy, y = cosine * dy - sine * dx;
      let inside = true;
      for (let a = this.start[i], b = this.start[i + 1] - 1; a < this.start[i + 1] && inside; b = a++) {
        const bx = this.shape[2 * b], by = this.shape[2 * b + 1];
        inside = (this.shape[2 * a] - bx) * (y - by) - (this.shape[2 * a + 1] - by) * (x - bx) >= 0;
      }
      if (inside) return i;
    }
    return -1;
  }
}
