"use strict";

/** A curve over time with a mark at the present frame; a click shows that time. */
class Curve {
  constructor(parent, facts, name, go) {
    this.facts = facts;
    this.choice = document.createElement("select");
    for (const each of Object.keys(facts.curves)) {
      this.choice.add(new Option(each.replaceAll("_", " "), each, false, each === name));
    }
    this.choice.setAttribute("aria-label", "curve");
    const plot = document.createElement("div");
    plot.className = "curve";
    this.canvas = document.createElement("canvas");
    this.mark = document.createElement("i");
    plot.append(this.canvas, this.mark);
    parent.append(this.choice, plot);
    this.left = 56;
    this.frame = 0;
    this.choice.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.canvas.addEventListener("click", (event) => {
      const share = (event.offsetX - this.left) / (this.canvas.clientWidth - this.left - 4);
      const {times} = facts, time = times[0] + share * (times[times.length - 1] - times[0]);
      go(times.reduce((best, each, k) => (Math.abs(each - time) < Math.abs(times[best] - time) ? k : best), 0));
    });
  }

  /** Put the mark at a frame. */
  show(frame) {
    const {times} = this.facts, span = times[times.length - 1] - times[0] || 1;
    this.frame = frame;
    this.mark.style.transform = `translateX(${this.left + this.wide * (times[frame] - times[0]) / span}px)`;
  }

  /** Draw the curve. */
  draw() {
    const ratio = window.devicePixelRatio || 1, width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    const {values, unit} = this.facts.curves[this.choice.value], {times} = this.facts;
    let low = Infinity, high = -Infinity;
    for (const value of values) if (value !== null) [low, high] = [Math.min(low, value), Math.max(high, value)];
    if (!(high > low)) [low, high] = high === low ? [low - 1, high + 1] : [0, 1];
    const span = times[times.length - 1] - times[0] || 1;
    this.wide = width - this.left - 4;
    const x = (k) => this.left + this.wide * (times[k] - times[0]) / span;
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
    ink.strokeRect(this.left, 6, this.wide, height - 22);
    ink.strokeStyle = "#0072b2";
    ink.lineWidth = 1.5;
    ink.beginPath();
    values.forEach((value, k) => { if (value !== null) ink.lineTo(x(k), y(value)); });
    ink.stroke();
    this.show(this.frame);
  }
}
