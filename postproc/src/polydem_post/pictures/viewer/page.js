"use strict";

// Joins the parts of the page. `viewer` is there for scripts and for the console of the browser.

class Viewer {
  constructor(run) {
    this.run = run;
    this.painter = new Painter(document.getElementById("scene"), run);
    this.overlays = new Set();
    this.chosen = -1;
    this.playing = false;
    this.frame = 0;
    /** Time of the script for each of the last frames [ms], and how many frames were drawn. */
    this.scriptTimes = [];
    this.drawn = 0;
    this.prepareControls();
    this.preparePointer();
    this.painter.warmUp(run.facts.colour);
    this.setColour(run.facts.colour);
  }

  /** Draw a frame. */
  show(frame) {
    const began = performance.now();
    frame = Math.min(Math.max(frame, 0), this.run.frames - 1);
    if (frame !== this.run.frame) this.run.go(frame);
    this.frame = frame;
    const {facts} = this.run;
    this.painter.draw(this.colour, this.overlays, this.chosen);
    this.scrub.value = frame;
    this.time.textContent = `t = ${number(facts.times[frame])} s, frame ${facts.frames[frame]}`;
    for (const curve of this.curves) curve.show(frame);
    if (this.chosen >= 0) this.tell();
    this.scriptTimes.push(performance.now() - began);
    if (this.scriptTimes.length > 1000) this.scriptTimes.shift();
    this.drawn++;
  }

  redraw() { this.show(this.frame); }

  setColour(name) {
    const fact = this.run.facts.quantities[name];
    this.colour = fact ? name : "none";
    document.getElementById("colour").value = this.colour;
    document.getElementById("scale").hidden = !fact;
    const bytes = new Uint8Array(768);
    if (fact) {
      const text = atob(this.run.facts.maps[fact.map]);
      for (let k = 0; k < 768; k++) bytes[k] = text.charCodeAt(k);
      const bar = document.getElementById("bar").getContext("2d"), image = bar.createImageData(256, 1);
      for (let k = 0; k < 256; k++) image.data.set([bytes[3 * k], bytes[3 * k + 1], bytes[3 * k + 2], 255], 4 * k);
      bar.putImageData(image, 0, 0);
      document.getElementById("low").textContent = number(fact.range[0]);
      document.getElementById("high").textContent = `${number(fact.range[1])} ${fact.unit}`;
    }
    this.painter.setColours(bytes);
    this.redraw();
  }

  setOverlay(name, on) {
    if (on) this.overlays.add(name);
    else this.overlays.delete(name);
    document.getElementById("show-" + name).checked = on;
    const forces = this.overlays.has("forces");
    document.getElementById("widths").textContent = forces
      ? `The widest line stands for ${number(this.run.facts.contacts.covered)} N/m or more.` : "";
    this.redraw();
  }

  choose(i) {
    this.chosen = i;
    if (i < 0) document.getElementById("body").innerHTML = "<tr><td>Click on a body to see its numbers.</td></tr>";
    this.redraw();
  }

  /** The numbers of the chosen body. */
  tell() {
    const table = document.getElementById("body"), numbers = numbersOf(this.run, this.chosen);
    if (table.rows.length !== numbers.length) {
      table.replaceChildren();
      for (const [name] of numbers) {
        const row = table.insertRow();
        row.insertCell().textContent = name;
        row.insertCell();
      }
    }
    numbers.forEach(([, value], k) => { table.rows[k].cells[1].textContent = value; });
  }

  play(on) {
    if (on === this.playing) return;
    this.playing = on;
    document.getElementById("play").textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (this.frame === this.run.frames - 1) this.show(0);
    let next = performance.now() + 1000 / this.perSecond;
    const turn = (now) => {
      if (!this.playing) return;
      if (now >= next && !this.painter.isDrawing()) {
        next = Math.max(next + 1000 / this.perSecond, now);
        this.show(this.frame + 1);
        if (this.frame === this.run.frames - 1) {
          this.play(false);
          return;
        }
      }
      requestAnimationFrame(turn);
    };
    requestAnimationFrame(turn);
  }

  get perSecond() { return Number(document.getElementById("speed").value); }

  prepareControls() {
    const {facts} = this.run, find = (id) => document.getElementById(id);
    this.scrub = find("scrub");
    this.time = find("time");
    this.scrub.max = this.run.frames - 1;
    this.scrub.addEventListener("input", () => { this.play(false); this.show(Number(this.scrub.value)); });
    find("play").addEventListener("click", () => this.play(!this.playing));
    for (const [name, fact] of Object.entries(facts.quantities)) find("colour").add(new Option(fact.title, name));
    find("colour").add(new Option("none", "none"));
    find("colour").addEventListener("change", (event) => this.setColour(event.target.value));
    for (const [name, meaning] of Object.entries(facts.overlays)) {
      const label = document.createElement("label"), box = document.createElement("input");
      Object.assign(box, {type: "checkbox", id: "show-" + name});
      box.addEventListener("change", () => this.setOverlay(name, box.checked));
      label.append(box, " " + meaning);
      find("overlays").append(label);
    }
    this.curves = Object.keys(facts.curves).length === 0 ? []
      : ["kinetic", "potential"].map((name) => new Curve(find("curves"), facts, name, (k) => this.show(k)));
    find("rounding").textContent = this.rounding();
    new ResizeObserver(() => { this.painter.resize(); this.redraw(); }).observe(this.painter.canvas);
    window.addEventListener("keydown", (event) => this.press(event));
  }

  rounding() {
    const {series, contacts} = this.run.facts, half = (name) => number(0.5 * series[name].quantum);
    return `Rounded: positions by up to ${half("x")} m, angles ${half("angle")} rad, velocities ${half("vx")} and ` +
      `${half("vy")} m/s, angular velocities ${half("spin")} rad/s` +
      (contacts ? `, forces by 0.4 % of the root of the greatest (${number(contacts.greatest)} N/m) and 0.7°.` : ".");
  }

  press(event) {
    if (["SELECT", "INPUT"].includes(event.target.tagName)) return;
    if (event.key === " " && event.target.tagName !== "BUTTON") this.play(!this.playing);
    else if (event.key === "ArrowRight") this.show(this.frame + 1);
    else if (event.key === "ArrowLeft") this.show(this.frame - 1);
    else if (event.key === "Home") this.show(0);
    else if (event.key === "End") this.show(this.run.frames - 1);
    else return;
    event.preventDefault();
  }

  preparePointer() {
    const {canvas} = this.painter, {painter} = this;
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      held = {x: event.offsetX, y: event.offsetY, far: false};
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      if (!held.far && Math.hypot(event.offsetX - held.x, event.offsetY - held.y) < 4) return;
      const step = painter.shown.height / canvas.clientHeight;
      painter.shown.x -= (event.offsetX - held.x) * step;
      painter.shown.y += (event.offsetY - held.y) * step;
      held = {x: event.offsetX, y: event.offsetY, far: true};
      this.redraw();
    });
    canvas.addEventListener("pointerup", (event) => {
      if (held && !held.far) this.choose(this.run.bodyAt(...painter.placeAt(event.offsetX, event.offsetY)));
      held = null;
    });
    canvas.addEventListener("pointercancel", () => { held = null; });
    canvas.addEventListener("dblclick", () => { painter.fit(); this.redraw(); });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const before = painter.placeAt(event.offsetX, event.offsetY);
      painter.shown.height *= Math.exp(0.0015 * event.deltaY * (event.deltaMode ? 30 : 1));
      const after = painter.placeAt(event.offsetX, event.offsetY);
      painter.shown.x += before[0] - after[0];
      painter.shown.y += before[1] - after[1];
      this.redraw();
    }, {passive: false});
  }
}

/** Read the data and show the first frame; what cannot be done is said in the page. */
async function begin() {
  const message = document.getElementById("message");
  try {
    if (!window.DecompressionStream) {
      throw new Error("This browser cannot inflate data (no DecompressionStream): it is too old.");
    }
    window.viewer = new Viewer(await Run.read());
    message.remove();
  } catch (error) {
    message.textContent = error.message;
    window.failure = error;
  }
}

window.ready = begin();
