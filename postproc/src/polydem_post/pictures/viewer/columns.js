"use strict";

// Quantities of a body in the present frame; their names, units and ranges are in the facts.

const TURN = 2 * Math.PI;

const length = (x, y) => Math.sqrt(x * x + y * y);

/** Name of a quantity -> its value for a body. */
const COLUMNS = {
  speed: (run, i) => length(run.value(run.series.vx, i), run.value(run.series.vy, i)),
  velocity_x: (run, i) => run.value(run.series.vx, i),
  velocity_y: (run, i) => run.value(run.series.vy, i),
  angular_velocity: (run, i) => run.value(run.series.spin, i),
  angle: (run, i) => ((run.value(run.series.angle, i) % TURN) + TURN) % TURN,
  rotation: (run, i) => run.value(run.series.angle, i),
  size: (run, i) => Math.sqrt(4 * run.area[i] / Math.PI),
  mass: (run, i) => run.mass[i],
  density: (run, i) => run.mass[i] / run.area[i],
  material: (run, i) => run.material[i],
  id: (run, i) => run.id[i] % 20,
  force: (run, i) => { const {fx, fy} = run.contactSums(); return length(fx[i], fy[i]); },
  load: (run, i) => run.contactSums().load[i],
  coordination: (run, i) => run.contactSums().count[i],
  pressure: (run, i) => { const {xx, yy} = run.contactSums(); return -0.5 * (xx[i] + yy[i]) / run.area[i]; },
  shear_stress: (run, i) => {
    const {xx, yy, xy} = run.contactSums();
    return length(0.5 * (xx[i] - yy[i]), xy[i]) / run.area[i];
  },
};

/** Numbers of one body for the table: [name, value]. */
function numbersOf(run, i) {
  const rows = [["identifier", run.id[i]], ["kind", run.fixed[i] ? "fixed" : "free"],
    ["corners", run.start[i + 1] - run.start[i]],
    ["x [m]", number(run.x[i])], ["y [m]", number(run.y[i])]];
  for (const [name, fact] of Object.entries(run.facts.quantities)) {
    if (name !== "id") rows.push([fact.title, number(COLUMNS[name](run, i))]);
  }
  return rows;
}

/** A number with four digits. */
function number(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  return value !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(3) : String(+value.toPrecision(4));
}
