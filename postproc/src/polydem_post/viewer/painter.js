"use strict";

// Draws the present frame of a run with WebGL 2: bodies whose corners are turned on the graphics unit, and segments.

const BODY_VERTEX = `#version 300 es
in vec2 corner;
in float body;
uniform highp sampler2D state;
uniform highp sampler2D value;
uniform vec2 middle, scale;
flat out float shade;
void main() {
  ivec2 at = ivec2(int(body) % 1024, int(body) / 1024);
  vec4 s = texelFetch(state, at, 0);
  vec2 turned = vec2(s.z * corner.x - s.w * corner.y, s.w * corner.x + s.z * corner.y);
  gl_Position = vec4((s.xy + turned - middle) * scale, 0.0, 1.0);
  shade = texelFetch(value, at, 0).x;
}`;

const BODY_FRAGMENT = `#version 300 es
precision highp float;
flat in float shade;
uniform sampler2D colours;
uniform bool outline;
out vec4 colour;
void main() {
  vec3 filled = shade <= -2.5 ? vec3(0.851, 0.725, 0.541) : shade <= -1.5 ? vec3(0.85)
    : shade < -0.5 ? vec3(0.62) : texelFetch(colours, ivec2(int(min(shade * 256.0, 255.0)), 0), 0).rgb;
  colour = vec4(outline ? vec3(0.1) : filled, 1.0);
}`;

const SEGMENT_VERTEX = `#version 300 es
in vec2 from, to;
in float width;
uniform vec2 middle, scale, elements;
flat out float cover;
void main() {
  vec2 a = (from - middle) * scale * elements, b = (to - middle) * scale * elements;
  vec2 along = b - a;
  float size = length(along);
  along = size > 1e-6 ? along / size : vec2(1.0, 0.0);
  float side = gl_VertexID % 2 == 0 ? 1.0 : -1.0;
  float half_width = 0.5 * width * scale.y * elements.y;
  cover = width > 0.0 ? min(2.0 * half_width, 1.0) : 1.0;
  half_width = max(half_width, 0.5);
  vec2 place = (gl_VertexID < 2 ? a : b) + side * half_width * vec2(-along.y, along.x);
  gl_Position = vec4(place / elements, 0.0, 1.0);
}`;

const BOX_VERTEX = `#version 300 es
in vec4 box;
uniform vec2 middle, scale;
flat out float cover;
void main() {
  vec2 corner = vec2(gl_VertexID == 1 || gl_VertexID == 2 ? box.z : box.x, gl_VertexID < 2 ? box.y : box.w);
  gl_Position = vec4((corner - middle) * scale, 0.0, 1.0);
  cover = 1.0;
}`;

const SEGMENT_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 ink;
flat in float cover;
out vec4 colour;
void main() { colour = vec4(ink, cover); }`;

/** Bodies in one row of the textures of their state. */
const ROW = 1024;

/** What stands for a value in the texture of shades. */
const FIXED = -1, UNKNOWN = -2, PLAIN = -3;

/** Outlines are drawn where bodies are at least so large [picture elements]. */
const LEAST_OUTLINED = 5;

class Painter {
  constructor(canvas, run) {
    this.canvas = canvas;
    this.run = run;
    this.gl = canvas.getContext("webgl2", {antialias: true, alpha: false});
    if (!this.gl) throw new Error("This browser has no WebGL 2, which the viewer needs to draw bodies. " +
      "Try another browser, or make a film: ./polydem movie.");
    const [x0, y0, x1, y1] = run.facts.limits;
    this.origin = [0.5 * (x0 + x1), 0.5 * (y0 + y1)];
    this.shown = {x: this.origin[0], y: this.origin[1], height: 1};
    this.prepareBodies();
    this.segments = this.shapes(SEGMENT_VERTEX, [["from", 2, 0], ["to", 2, 8], ["width", 1, 16]], this.gl.TRIANGLE_STRIP);
    this.boxes = this.shapes(BOX_VERTEX, [["box", 4, 0]], this.gl.LINE_LOOP);
    // Lines thinner than a picture element are fainter instead.
    this.gl.enable(this.gl.BLEND);
    this.gl.blendFunc(this.gl.SRC_ALPHA, this.gl.ONE_MINUS_SRC_ALPHA);
    this.fit();
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const places = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const {name} = gl.getActiveUniform(program, k);
      places[name] = gl.getUniformLocation(program, name);
    }
    return {program, places, attribute: (name) => gl.getAttribLocation(program, name)};
  }

  prepareBodies() {
    const gl = this.gl, run = this.run, total = run.start[run.n];
    this.bodies = this.program(BODY_VERTEX, BODY_FRAGMENT);
    const bodyOf = new Float32Array(total), fan = [], edges = [];
    for (let i = 0; i < run.n; i++) {
      const first = run.start[i], end = run.start[i + 1];
      for (let v = first; v < end; v++) {
        bodyOf[v] = i;
        if (v > first + 1) fan.push(first, v - 1, v);
        edges.push(v, v + 1 < end ? v + 1 : first);
      }
    }
    this.corners = gl.createVertexArray();
    gl.bindVertexArray(this.corners);
    this.attribute(this.bodies.attribute("corner"), 2, run.shape);
    this.attribute(this.bodies.attribute("body"), 1, bodyOf);
    this.fan = this.indices(fan);
    this.edges = this.indices(edges);
    this.rows = Math.ceil(run.n / ROW);
    this.stateData = new Float32Array(4 * ROW * this.rows);
    this.shadeData = new Float32Array(ROW * this.rows);
    this.state = this.texture();
    this.shade = this.texture();
    this.colours = this.texture();
  }

  attribute(place, size, data) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
  }

  indices(list) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from(list), gl.STATIC_DRAW);
    return {buffer, count: list.length};
  }

  texture() {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    return texture;
  }

  /** A list of shapes and what draws them: numbers of each by name, count and offset, and how four corners are joined. */
  shapes(vertex, attributes, joined) {
    const gl = this.gl, program = this.program(vertex, SEGMENT_FRAGMENT);
    const numbers = attributes.reduce((sum, [, size]) => sum + size, 0);
    const array = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (const [name, size, offset] of attributes) {
      const place = program.attribute(name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * numbers, offset);
      gl.vertexAttribDivisor(place, 1);
    }
    return {program, array, buffer, joined, list: new Shapes(numbers, ...this.origin)};
  }

  /** Colours of the scale, 256 times red, green and blue. */
  setColours(bytes) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.colours);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, bytes);
  }

  /** Show all bodies. */
  fit() {
    const [x0, y0, x1, y1] = this.run.facts.limits, aspect = this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1);
    this.shown = {x: this.origin[0], y: this.origin[1], height: Math.max(y1 - y0, (x1 - x0) / aspect)};
  }

  /** Place in the plane of a place in the canvas [CSS picture elements]. */
  placeAt(left, top) {
    const {clientWidth: width, clientHeight: height} = this.canvas, step = this.shown.height / height;
    return [this.shown.x + (left - 0.5 * width) * step, this.shown.y - (top - 0.5 * height) * step];
  }

  /** Draw the present frame: values of a quantity (null: all alike), names of overlays, and the body that is chosen. */
  draw(values, range, overlays, chosen) {
    const gl = this.gl, canvas = this.canvas, ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    gl.viewport(0, 0, width, height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const step = this.shown.height / height;
    this.view = {middle: [this.shown.x - this.origin[0], this.shown.y - this.origin[1]],
      scale: [2 / (step * width), 2 / (step * height)], elements: [0.5 * width, 0.5 * height]};
    this.upload(values, range);
    this.drawBodies(this.run.facts.diameter / step >= LEAST_OUTLINED * ratio);
    for (const name of Object.keys(OVERLAYS)) {
      if (!overlays.has(name)) continue;
      const {make, shapes, colour} = OVERLAYS[name];
      this[shapes].list.clear();
      make(this.run, this[shapes].list);
      this.drawShapes(this[shapes], colour);
    }
    if (chosen >= 0) this.drawChosen(chosen, 2.5 * ratio * step);
  }

  upload(values, [low, high]) {
    const run = this.run, state = this.stateData, shade = this.shadeData, factor = 1 / (high - low);
    for (let i = 0; i < run.n; i++) {
      state[4 * i] = run.x[i] - this.origin[0];
      state[4 * i + 1] = run.y[i] - this.origin[1];
      state[4 * i + 2] = run.cosine[i];
      state[4 * i + 3] = run.sine[i];
      shade[i] = run.fixed[i] ? FIXED : !values ? PLAIN
        : Number.isFinite(values[i]) ? Math.min(Math.max((values[i] - low) * factor, 0), 1) : UNKNOWN;
    }
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.state);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, ROW, this.rows, 0, gl.RGBA, gl.FLOAT, state);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.shade);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, ROW, this.rows, 0, gl.RED, gl.FLOAT, shade);
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, this.colours);
  }

  drawBodies(outlined) {
    const gl = this.gl, {program, places} = this.bodies;
    gl.useProgram(program);
    gl.bindVertexArray(this.corners);
    gl.uniform1i(places.state, 0);
    gl.uniform1i(places.value, 1);
    gl.uniform1i(places.colours, 2);
    gl.uniform2fv(places.middle, this.view.middle);
    gl.uniform2fv(places.scale, this.view.scale);
    for (const [list, kind, outline] of [[this.fan, gl.TRIANGLES, 0], [this.edges, gl.LINES, 1]]) {
      if (outline && !outlined) continue;
      gl.uniform1i(places.outline, outline);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, list.buffer);
      gl.drawElements(kind, list.count, gl.UNSIGNED_INT, 0);
    }
  }

  drawShapes({program: {program, places}, array, buffer, joined, list}, colour) {
    const gl = this.gl;
    gl.useProgram(program);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, list.data.subarray(0, list.numbers * list.n), gl.STREAM_DRAW);
    gl.uniform2fv(places.middle, this.view.middle);
    gl.uniform2fv(places.scale, this.view.scale);
    if (places.elements) gl.uniform2fv(places.elements, this.view.elements);
    gl.uniform3fv(places.ink, colour);
    gl.drawArraysInstanced(joined, 0, 4, list.n);
  }

  drawChosen(i, width) {
    const {run} = this, segments = this.segments.list, place = (v) => [
      run.x[i] + run.cosine[i] * run.shape[2 * v] - run.sine[i] * run.shape[2 * v + 1],
      run.y[i] + run.sine[i] * run.shape[2 * v] + run.cosine[i] * run.shape[2 * v + 1]];
    segments.clear();
    segments.reserve(run.start[i + 1] - run.start[i]);
    for (let v = run.start[i], w = run.start[i + 1] - 1; v < run.start[i + 1]; w = v++) segments.add(...place(w), ...place(v), width);
    this.drawShapes(this.segments, [1, 0, 1]);
  }
}
