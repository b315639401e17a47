"use strict";

// Quantities of bodies in the present frame, one value per body; their names, units and ranges are in the facts.

const TURN = 2 * Math.PI;

/** Values that come from the contacts: sums over those of each body. */
function contactSums(run, add) {
  const sums = Array.from({length: 4}, () => new Float64Array(run.n));
  const t = run.contacts;
  for (let c = 0; c < t.n; c++) {
    add(sums, t.first[c], c, 1);
    add(sums, t.second[c], c, -1);
  }
  return sums;
}

/** Mean stress of each body: xx, yy and the symmetric xy [N/m2]. */
function stresses(run) {
  const t = run.contacts;
  const sums = contactSums(run, (sum, i, c, sign) => {
    const rx = sign * (t.x[c] - run.x[i]), ry = sign * (t.y[c] - run.y[i]);
    sum[0][i] += rx * t.fx[c];
    sum[1][i] += ry * t.fy[c];
    sum[2][i] += 0.5 * (rx * t.fy[c] + ry * t.fx[c]);
  });
  for (let i = 0; i < run.n; i++) for (let k = 0; k < 3; k++) sums[k][i] /= run.area[i];
  return sums;
}

const each = (value) => (run) => {
  const values = new Float64Array(run.n);
  for (let i = 0; i < run.n; i++) values[i] = value(run, i);
  return values;
};

/** Name of a quantity -> its values. */
const COLUMNS = {
  speed: each((run, i) => Math.hypot(run.value("vx", i), run.value("vy", i))),
  velocity_x: each((run, i) => run.value("vx", i)),
  velocity_y: each((run, i) => run.value("vy", i)),
  angular_velocity: each((run, i) => run.value("spin", i)),
  angle: each((run, i) => ((run.value("angle", i) % TURN) + TURN) % TURN),
  rotation: each((run, i) => run.value("angle", i)),
  size: each((run, i) => Math.sqrt(4 * run.area[i] / Math.PI)),
  mass: each((run, i) => run.mass[i]),
  density: each((run, i) => run.mass[i] / run.area[i]),
  material: each((run, i) => run.material[i]),
  id: each((run, i) => run.id[i] % 20),
  force: (run) => {
    const t = run.contacts;
    const sums = contactSums(run, (sum, i, c, sign) => { sum[0][i] += sign * t.fx[c]; sum[1][i] += sign * t.fy[c]; });
    return sums[0].map((fx, i) => Math.hypot(fx, sums[1][i]));
  },
  load: (run) => contactSums(run, (sum, i, c) => { sum[0][i] += run.contacts.size[c]; })[0],
  coordination: (run) => contactSums(run, (sum, i) => { sum[0][i] += 1; })[0],
  pressure: (run) => { const [xx, yy] = stresses(run); return xx.map((value, i) => -0.5 * (value + yy[i])); },
  shear_stress: (run) => {
    const [xx, yy, xy] = stresses(run);
    return xx.map((value, i) => Math.hypot(0.5 * (value - yy[i]), xy[i]));
  },
};

/** Numbers of one body for the table: [name, value]. */
function numbersOf(run, i) {
  const rows = [["identifier", run.id[i]], ["kind", run.fixed[i] ? "fixed" : "free"],
    ["corners", run.start[i + 1] - run.start[i]],
    ["x [m]", number(run.x[i])], ["y [m]", number(run.y[i])]];
  for (const [name, fact] of Object.entries(run.facts.quantities)) {
    if (name !== "id") rows.push([fact.title, number(COLUMNS[name](run)[i])]);
  }
  return rows;
}

/** A number with four digits. */
function number(value) {
  if (!Number.isFinite(value)) return "–";
  return value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e5) ? value.toExponential(3) : String(+value.toPrecision(4));
}
