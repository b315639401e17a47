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
    for (const name of Object.keys(facts.series)) {
      run.series[name] = await readSeries(name, facts.series[name], run.frames, run.n);
    }
    run.area = run.areas();
    if (facts.contacts) await run.readContacts();
    run.x = new Float64Array(run.n);
    run.y = new Float64Array(run.n);
    run.cosine = new Float64Array(run.n);
    run.sine = new Float64Array(run.n);
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
        for (let bits = present[b]; bits; bits &= bits - 1) this.contactPair[c++] = 8 * b + 31 - Math.clz32(bits & -bits);
      }
    }
    this.cosines = Float64Array.from({length: 256}, (_, k) => Math.cos(2 * Math.PI * k / 256));
    this.sines = Float64Array.from({length: 256}, (_, k) => Math.sin(2 * Math.PI * k / 256));
    const most = Math.max(...facts.count, 0);
    this.contacts = {
      n: 0, first: new Uint32Array(most), second: new Uint32Array(most), x: new Float64Array(most),
      y: new Float64Array(most), fx: new Float64Array(most), fy: new Float64Array(most), size: new Float64Array(most),
    };
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
  value(name, i) { return this.series[name][this.frame * this.n + i] * this.facts.series[name].quantum; }

  /** Make a frame the present one. */
  go(frame) {
    this.frame = frame;
    this.hasBounds = false;
    const {x, y, angle} = this.series, quanta = this.facts.series, base = frame * this.n;
    for (let i = 0; i < this.n; i++) {
      this.x[i] = x[base + i] * quanta.x.quantum;
      this.y[i] = y[base + i] * quanta.y.quantum;
      const turned = angle[base + i] * quanta.angle.quantum;
      this.cosine[i] = Math.cos(turned);
      this.sine[i] = Math.sin(turned);
    }
    if (this.contacts) this.findContacts();
  }

  findContacts() {
    const facts = this.facts.contacts, table = this.contacts, from = this.contactStart[this.frame];
    const arm = facts.reach / 127;
    table.n = this.contactStart[this.frame + 1] - from;
    for (let c = 0; c < table.n; c++) {
      const k = from + c, pair = this.contactPair[k], first = this.pairFirst[pair], second = this.pairSecond[pair];
      const base = this.fixed[first] ? second : first;
      const root = this.forceRoot[k] / 255;
      table.first[c] = first;
      table.second[c] = second;
      table.x[c] = this.x[base] + arm * this.armX[k];
      table.y[c] = this.y[base] + arm * this.armY[k];
      table.size[c] = facts.greatest * root * root;
      table.fx[c] = table.size[c] * this.cosines[this.direction[k]];
      table.fy[c] = table.size[c] * this.sines[this.direction[k]];
    }
  }

  /** Bounding boxes of the bodies in the present frame: xmin, ymin, xmax, ymax of each. */
  boxes() {
    if (this.hasBounds) return this.bounds;
    const {shape, start, bounds} = this;
    for (let i = 0; i < this.n; i++) {
      const c = this.cosine[i], s = this.sine[i];
      let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
      for (let v = 2 * start[i]; v < 2 * start[i + 1]; v += 2) {
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
      const dx = px - this.x[i], dy = py - this.y[i];
      const x = this.cosine[i] * dx + this.sine[i] * dy, y = this.cosine[i] * dy - this.sine[i] * dx;
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
