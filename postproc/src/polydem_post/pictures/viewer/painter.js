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
  ivec2 at = ivec2(int(body) % ${ROW}, int(body) / ${ROW});
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

/** Six vertices for each segment: two triangles. */
const SEGMENT_VERTEX = `#version 300 es
uniform highp sampler2D shapes;
uniform vec2 middle, scale, elements;
flat out float cover;
vec4 texel(int k) { return texelFetch(shapes, ivec2(k % ${ROW}, k / ${ROW}), 0); }
void main() {
  int segment = gl_VertexID / 6, vertex = gl_VertexID % 6;
  int corner = vertex < 3 ? vertex : vertex - 2;
  vec4 from = texel(2 * segment);
  vec2 a = (from.xy - middle) * scale * elements, b = (texel(2 * segment + 1).xy - middle) * scale * elements;
  vec2 along = b - a;
  float size = length(along);
  along = size > 1e-6 ? along / size : vec2(1.0, 0.0);
  float half_width = 0.5 * from.z * scale.y * elements.y;
  cover = min(2.0 * half_width, 1.0);
  half_width = corner % 2 == 0 ? max(half_width, 0.5) : -max(half_width, 0.5);
  vec2 place = (corner < 2 ? a : b) + half_width * vec2(-along.y, along.x);
  gl_Position = vec4(place / elements, 0.0, 1.0);
}`;

/** Eight vertices for each box: four lines. */
const BOX_VERTEX = `#version 300 es
uniform highp sampler2D shapes;
uniform vec2 middle, scale;
flat out float cover;
void main() {
  int k = gl_VertexID / 8, corner = (gl_VertexID % 8 + 1) / 2 % 4;
  vec4 box = texelFetch(shapes, ivec2(k % ${ROW}, k / ${ROW}), 0);
  vec2 place = vec2(corner == 1 || corner == 2 ? box.z : box.x, corner < 2 ? box.y : box.w);
  gl_Position = vec4((place - middle) * scale, 0.0, 1.0);
  cover = 1.0;
}`;

const SEGMENT_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 ink;
flat in float cover;
out vec4 colour;
void main() { colour = vec4(ink, cover); }`;

/** What stands for a value in the texture of shades. */
const FIXED = -1, UNKNOWN = -2, PLAIN = -3;

/** Texture unit of what is laid over the bodies; those before are state, shades and colours. */
const SHAPES = 3;

/** Outlines are drawn where bodies are at least so large [picture elements]. */
const LEAST_OUTLINED = 5;

/** Frames that are made before the first is shown. */
const WARMING = 8;

class Painter {
  constructor(canvas, run) {
    this.canvas = canvas;
    this.run = run;
    this.gl = canvas.getContext("webgl2", {antialias: true, alpha: false});
    if (!this.gl) throw new Error("This browser has no WebGL 2, which the viewer needs to draw bodies. " +
      "Try another browser, or make a film: ./polydem movie.");
    this.shown = {x: 0, y: 0, height: 1};
    this.prepareBodies();
    this.programs = {
      segments: {...this.program(SEGMENT_VERTEX, SEGMENT_FRAGMENT), texels: 2, vertices: 6, kind: this.gl.TRIANGLES},
      boxes: {...this.program(BOX_VERTEX, SEGMENT_FRAGMENT), texels: 1, vertices: 8, kind: this.gl.LINES},
    };
    this.layers = {};
    for (const name of Object.keys(OVERLAYS)) this.layers[name] = this.layer();
    this.outline = this.layer();
    this.nothing = this.gl.createVertexArray();
    this.resize();
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
    this.state = this.texture(0);
    this.shade = this.texture(1);
    this.colours = this.texture(2);
    this.rows = run.state.length / (4 * ROW);
    this.shadeData = new Float32Array(ROW * this.rows);
    /** The frame whose state is on the graphics unit, and the quantity and frame of its shades. */
    this.present = {state: -1, colour: null, shade: -1};
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

  /** A texture that stays bound to a unit. */
  texture(unit) {
    const gl = this.gl, texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  }

  /** Texels with the texture that holds them, and the frame to which they belong. */
  layer() { return {texels: new Texels(), texture: this.texture(SHAPES), rows: 0, frame: -1}; }

  /** Colours of the scale, 256 times red, green and blue. */
  setColours(bytes) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE2);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, bytes);
  }

  /** Take the size of the canvas in the page. */
  resize() {
    const {canvas} = this;
    this.ratio = window.devicePixelRatio || 1;
    this.width = Math.max(Math.round(canvas.clientWidth * this.ratio), 1);
    this.height = Math.max(Math.round(canvas.clientHeight * this.ratio), 1);
    if (canvas.width !== this.width || canvas.height !== this.height) {
      Object.assign(canvas, {width: this.width, height: this.height});
    }
  }

  /** Show all bodies. */
  fit() {
    const [x0, y0, x1, y1] = this.run.facts.limits, [x, y] = this.run.origin;
    this.shown = {x, y, height: Math.max(y1 - y0, (x1 - x0) * this.height / this.width)};
  }

  /** Place in the plane of a place in the canvas [CSS picture elements]. */
  placeAt(left, top) {
    const {clientWidth: width, clientHeight: height} = this.canvas, step = this.shown.height / height;
    return [this.shown.x + (left - 0.5 * width) * step, this.shown.y - (top - 0.5 * height) * step];
  }

  /** Draw the present frame: name of a quantity (another: all alike), names of overlays, and the chosen body. */
  draw(colour, overlays, chosen) {
    const {gl, run, width, height} = this, [originX, originY] = run.origin, step = this.shown.height / height;
    gl.viewport(0, 0, width, height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    this.view = {middle: [this.shown.x - originX, this.shown.y - originY],
      scale: [2 / (step * width), 2 / (step * height)], elements: [0.5 * width, 0.5 * height]};
    this.uploadBodies(colour);
    this.drawBodies(run.facts.size / step >= LEAST_OUTLINED * this.ratio);
    if (run.facts.cells) this.drawCell(1.5 * this.ratio * step);
    for (const name of Object.keys(OVERLAYS)) {
      if (!overlays.has(name)) continue;
      const {make, shapes, colour: ink} = OVERLAYS[name], layer = this.layers[name];
      if (layer.frame !== run.frame) {
        make(run, layer.texels);
        this.uploadLayer(layer);
        layer.frame = run.frame;
      }
      this.drawLayer(layer, this.programs[shapes], ink);
    }
    if (chosen >= 0) this.drawChosen(chosen, 2.5 * this.ratio * step);
    if (this.fence) gl.deleteSync(this.fence);
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  /** Whether the last picture is still being drawn. What is sent meanwhile may have to wait for it. */
  isDrawing() {
    const {gl} = this;
    if (!this.fence || gl.isContextLost()) return false;
    if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return true;
    gl.deleteSync(this.fence);
    this.fence = null;
    return false;
  }

  /** Make some frames without drawing them: an engine runs new code slowly, and no frame that is shown shall wait. */
  warmUp(colour) {
    const {run} = this, last = run.frames - 1;
    for (let round = 0; round < WARMING; round++) {
      run.go(Math.max(last - round, 0));
      this.uploadBodies(colour);
      for (const name of Object.keys(run.facts.overlays)) OVERLAYS[name].make(run, this.layers[name].texels);
    }
    run.go(0);
  }

  /** State and shades of the bodies, unless they are there. */
  uploadBodies(colour) {
    const {gl, run, present, rows, shadeData: shade} = this;
    if (present.state !== run.frame) {
      gl.activeTexture(gl.TEXTURE0);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, ROW, rows, 0, gl.RGBA, gl.FLOAT, run.state);
      present.state = run.frame;
    }
    if (present.shade === run.frame && present.colour === colour) return;
    const value = COLUMNS[colour], [low, high] = value ? run.facts.quantities[colour].range : [0, 1];
    const factor = 1 / (high - low);
    for (let i = 0; i < run.n; i++) {
      if (run.fixed[i]) shade[i] = FIXED;
      else if (!value) shade[i] = PLAIN;
      else {
        const share = (value(run, i) - low) * factor;
        shade[i] = share === share ? Math.min(Math.max(share, 0), 1) : UNKNOWN;
      }
    }
    gl.activeTexture(gl.TEXTURE1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, ROW, rows, 0, gl.RED, gl.FLOAT, shade);
    Object.assign(present, {shade: run.frame, colour});
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

  uploadLayer(layer) {
    const {gl} = this, {texels} = layer, rows = texels.data.length / (4 * ROW);
    gl.activeTexture(gl.TEXTURE0 + SHAPES);
    gl.bindTexture(gl.TEXTURE_2D, layer.texture);
    if (layer.rows !== rows) gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, ROW, rows, 0, gl.RGBA, gl.FLOAT, null);
    layer.rows = rows;
    const used = Math.ceil(texels.n / ROW);
    if (used) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, used, gl.RGBA, gl.FLOAT, texels.data);
  }

  drawLayer({texels, texture}, {program, places, texels: each, vertices, kind}, colour) {
    const gl = this.gl;
    gl.useProgram(program);
    gl.bindVertexArray(this.nothing);
    gl.activeTexture(gl.TEXTURE0 + SHAPES);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(places.shapes, SHAPES);
    gl.uniform2fv(places.middle, this.view.middle);
    gl.uniform2fv(places.scale, this.view.scale);
    if (places.elements) gl.uniform2fv(places.elements, this.view.elements);
    gl.uniform3fv(places.ink, colour);
    gl.drawArrays(kind, 0, vertices * texels.n / each);
  }

  drawCell(width) {
    cellSegments(this.run, this.outline.texels, width);
    this.uploadLayer(this.outline);
    this.drawLayer(this.outline, this.programs.segments, [0, 0, 0]);
  }

  drawChosen(i, width) {
    const {run, outline} = this, {shape, start} = run, [x, y, cosine, sine] = run.state.subarray(4 * i, 4 * i + 4);
    const place = (v) => {
      const [across, up] = shape.subarray(2 * v, 2 * v + 2);
      return [x + cosine * across - sine * up, y + sine * across + cosine * up];
    };
    outline.texels.clear(2 * (start[i + 1] - start[i]));
    for (let v = start[i], w = start[i + 1] - 1; v < start[i + 1]; w = v++) {
      outline.texels.data.set([...place(w), width, 0, ...place(v), 0, 0], 4 * outline.texels.n);
      outline.texels.n += 2;
    }
    this.uploadLayer(outline);
    this.drawLayer(outline, this.programs.segments, [1, 0, 1]);
  }
}
