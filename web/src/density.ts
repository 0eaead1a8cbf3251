// Points by the million: rows in buffers of the graphics processor, their number by pixel in a texture, its logarithm
// as a picture. Another view draws the same buffers again, in parts, so that no frame waits for all of them.

const CHUNK = 1 << 17; // points of a buffer
const A_FRAME = 1 << 18; // points that are drawn in one frame, at most
const DENSE = 32; // a pixel has the colour of many at so many times the points that it would have were they spread evenly

const POINTS = `#version 300 es
in float x, y;
uniform vec2 middle, scale;
uniform float size;
void main() {
  gl_Position = vec4((vec2(x, y) - middle) * scale, 0.0, 1.0);
  gl_PointSize = size;
}`;
const ONE = `#version 300 es
precision mediump float;
out vec4 count;
void main() { count = vec4(1.0); }`;
const WHOLE = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;
const COLOURS = `#version 300 es
precision highp float;
uniform highp sampler2D counts;
uniform vec3 few, many;
uniform float full;
out vec4 colour;
void main() {
  float count = texelFetch(counts, ivec2(gl_FragCoord.xy), 0).r;
  float share = clamp(log(max(count, 1.0)) / full, 0.0, 1.0);
  colour = count > 0.0 ? vec4(mix(few, many, share), 1.0) : vec4(0.0);
}`;

/** What is seen: columns of the rows, their ranges, their part of the area of all points, pixels of the picture and of a point. */
export interface View {
  columns: [number, number];
  range: [x0: number, x1: number, y0: number, y1: number];
  part: number;
  size: [width: number, height: number];
  point: number;
}

export class Density {
  private width = 0; // numbers of a row
  private chunks: { buffer: WebGLBuffer; points: number }[] = [];
  private seen = ""; // the view of `drawn`
  private drawn = 0; // points that are counted

  /** WebGL 2 that adds in a texture of half floats; null where the browser has none. `lost` is called when it is gone. */
  static of(lost: () => void): Density | null {
    const canvas = document.createElement("canvas"), gl = canvas.getContext("webgl2", { antialias: false, depth: false });
    if (!gl?.getExtension("EXT_color_buffer_float") && !gl?.getExtension("EXT_color_buffer_half_float")) return null;
    canvas.addEventListener("webglcontextlost", lost);
    return new Density(canvas, gl);
  }

  private readonly points: WebGLProgram;
  private readonly colours: WebGLProgram;
  private readonly counts: WebGLTexture;
  private readonly target: WebGLFramebuffer;

  private constructor(readonly canvas: HTMLCanvasElement, private readonly gl: WebGL2RenderingContext) {
    this.points = this.program(POINTS, ONE);
    this.colours = this.program(WHOLE, COLOURS);
    this.counts = gl.createTexture();
    this.target = gl.createFramebuffer();
    gl.bindTexture(gl.TEXTURE_2D, this.counts);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    gl.blendFunc(gl.ONE, gl.ONE);
  }

  /** Forget the points; those to come have so many numbers. */
  clear(width: number): void {
    for (const { buffer } of this.chunks) this.gl.deleteBuffer(buffer);
    this.chunks = [];
    this.width = width;
    this.seen = "";
  }

  /** Add points, rows of `width` numbers. */
  add(rows: Float64Array): void {
    const { gl, width } = this, numbers = new Float32Array(rows);
    for (let from = 0; from < numbers.length; ) {
      let last = this.chunks.at(-1);
      if (!last || last.points === CHUNK) {
        this.chunks.push((last = { buffer: gl.createBuffer(), points: 0 }));
        gl.bindBuffer(gl.ARRAY_BUFFER, last.buffer);
        gl.bufferData(gl.ARRAY_BUFFER, 4 * width * CHUNK, gl.STATIC_DRAW);
      }
      const to = Math.min(numbers.length, from + width * (CHUNK - last.points));
      gl.bindBuffer(gl.ARRAY_BUFFER, last.buffer);
      gl.bufferSubData(gl.ARRAY_BUFFER, 4 * width * last.points, numbers.subarray(from, to));
      last.points += (to - from) / width;
      from = to;
    }
  }

  /** Draw points that this view does not have yet; colours are red, green and blue of 0 to 1. Returns how many it has. */
  show(view: View, few: number[], many: number[]): number {
    const { gl, canvas } = this, { columns, range, part, size, point } = view, key = JSON.stringify(view);
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    gl.viewport(0, 0, ...size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    if (key !== this.seen) {
      this.seen = key;
      this.drawn = 0;
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16F, ...size, 0, gl.RED, gl.HALF_FLOAT, null);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.counts, 0);
      gl.clear(gl.COLOR_BUFFER_BIT);
    }
    gl.useProgram(this.points);
    gl.enable(gl.BLEND);
    gl.uniform2f(this.at(this.points, "middle"), (range[0] + range[1]) / 2, (range[2] + range[3]) / 2);
    gl.uniform2f(this.at(this.points, "scale"), 2 / (range[1] - range[0]), 2 / (range[3] - range[2]));
    gl.uniform1f(this.at(this.points, "size"), point);
    for (let left = A_FRAME; left > 0; ) {
      const chunk = this.chunks[Math.floor(this.drawn / CHUNK)], first = this.drawn % CHUNK;
      const count = Math.min(left, (chunk?.points ?? 0) - first);
      if (count <= 0) break;
      gl.bindBuffer(gl.ARRAY_BUFFER, chunk.buffer);
      ["x", "y"].forEach((name, i) => {
        const place = gl.getAttribLocation(this.points, name);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 1, gl.FLOAT, false, 4 * this.width, 4 * columns[i]);
      });
      gl.drawArrays(gl.POINTS, first, count);
      this.drawn += count;
      left -= count;
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.BLEND);
    gl.useProgram(this.colours);
    gl.uniform3fv(this.at(this.colours, "few"), few);
    gl.uniform3fv(this.at(this.colours, "many"), many);
    gl.uniform1f(this.at(this.colours, "full"), Math.log(2 + (DENSE * this.drawn * part * point * point) / (size[0] * size[1])));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return this.drawn;
  }

  private at(program: WebGLProgram, name: string): WebGLUniformLocation | null {
    return this.gl.getUniformLocation(program, name);
  }
  private program(...sources: [vertex: string, fragment: string]): WebGLProgram {
    const { gl } = this, program = gl.createProgram();
    sources.forEach((source, i) => {
      const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER)!;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    });
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program) ?? "");
    return program;
  }
}
