"use strict";

// Reads the data in the page: facts as JSON, and blocks that are deflated and written as base64.

/** Bytes of a block, inflated; null if the page does not have it. The text is freed. */
async function readBlock(name) {
  const element = document.getElementById("block-" + name);
  if (!element) return null;
  const text = atob(element.textContent);
  element.remove();
  const packed = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) packed[k] = text.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A block as an array of numbers of a type. */
async function readArray(name, Type) {
  const bytes = await readBlock(name);
  return bytes ? new Type(bytes.buffer, 0, bytes.byteLength / Type.BYTES_PER_ELEMENT) : null;
}

/** One whole number per frame and body, in multiples of the quantum: sums of folded differences in planes of bytes. */
async function readSeries(name, fact, frames, bodies) {
  const bytes = await readBlock(name);
  const total = frames * bodies;
  const wide = fact.planes > 3;
  const values = wide ? new Float64Array(total) : new Int32Array(total);
  for (let k = 0; k < total; k++) {
    let folded = bytes[k];
    for (let plane = 1, weight = 256; plane < fact.planes; plane++, weight *= 256) {
      folded += weight * bytes[plane * total + k];
    }
    const change = folded % 2 === 0 ? folded / 2 : -(folded + 1) / 2;
    values[k] = change + (k >= bodies ? values[k - bodies] : 0);
  }
  return values;
}
