"use strict";

/** A curve over time with a mark at the present frame; a click shows that time. */
class Curve {
  constructor(parent, facts, name, go) {
    this.facts = facts;
    this.choice = document.createElement("select");
    for (const each of Object.keys(facts.curves)) this.choice.add(new Option(each.replaceAll("_", " "), each, false, each === name));
    this.canvas = document.createElement("canvas");
    this.choice.setAttribute("aria-label", "curve");
    parent.append(this.choice, this.canvas);
    this.frame = 0;
    this.choice.addEventListener("change", () => this.draw(this.frame));
    this.canvas.addEventListener("click", (event) => {
      const share = (event.offsetX - this.left) / (this.canvas.clientWidth - this.left - 4);
      const {times} = facts, time = times[0] + share * (times[times.length - 1] - times[0]);
      go(times.reduce((best, each, k) => (Math.abs(each - time) < Math.abs(times[best] - time) ? k : best), 0));
    });
  }

  /** Draw the curve, unless it is there, and the mark. */
  draw(frame) {
    this.frame = frame;
    const ratio = window.devicePixelRatio || 1, width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    this.left = 56;
    const {values, unit} = this.facts.curves[this.choice.value], {times} = this.facts;
    const known = values.filter((value) => value !== null);
    let low = Math.min(...known), high = Math.max(...known);
    if (!(high > low)) [low, high] = [low - 1, high + 1];
    const span = times[times.length - 1] - times[0] || 1;
    const x = (k) => this.left + (width - this.left - 4) * (times[k] - times[0]) / span;
    const y = (value) => 6 + (height - 22) * (high - value) / (high - low);
    Object.assign(this.canvas, {width: Math.round(width * ratio), height: Math.round(height * ratio)});
    const ink = this.canvas.getContext("2d");
    ink.scale(ratio, ratio);
    ink.font = "10px system-ui, sans-serif";
    ink.fillStyle = "#444";
    ink.textAlign = "right";
    ink.fillText(number(high), this.left - 4, 13);
    ink.fillText(number(low), this.left - 4, height - 16);
    ink.fillText(unit ? "[" + unit + "]" : "", this.left - 4, 0.5 * height);
    ink.fillText(number(times[times.length - 1]) + " s", width - 4, height - 3);
    ink.textAlign = "left";
    ink.fillText(number(times[0]) + " s", this.left, height - 3);
    ink.strokeStyle = "#bbb";
    ink.strokeRect(this.left, 6, width - this.left - 4, height - 22);
    ink.strokeStyle = "#0072b2";
    ink.lineWidth = 1.5;
    ink.beginPath();
    values.forEach((value, k) => { if (value !== null) ink.lineTo(x(k), y(value)); });
    ink.stroke();
    ink.strokeStyle = "#d55e00";
    ink.beginPath();
    ink.moveTo(x(frame), 6);
    ink.lineTo(x(frame), height - 16);
    ink.stroke();
  }
}
