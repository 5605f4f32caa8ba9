/** What WebGL 2 is asked for: shaders that are compiled once, textures of numbers, targets to draw into. */

const HEAD =
  "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;\nprecision highp usampler2D;\nprecision highp sampler2DArray;\n";

export class NoWebGL extends Error {}

export interface Target {
  frame: WebGLFramebuffer;
  texture: WebGLTexture;
  depth: WebGLRenderbuffer | null;
  width: number;
  height: number;
}

export class Shader {
  private places = new Map<string, WebGLUniformLocation | null>();
  constructor(
    private gl: WebGL2RenderingContext,
    readonly program: WebGLProgram,
  ) {}
  at(name: string): WebGLUniformLocation | null {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name)!;
  }
}

export class Gpu {
  /** How many shaders have been compiled. */
  compilations = 0;
  private shaders = new Map<string, Shader>();
  private textures = new Map<string, WebGLTexture>();
  private nothing: Target | null = null;

  constructor(readonly gl: WebGL2RenderingContext) {}

  /** After the context was lost nothing of it is left. */
  forget(): void {
    this.shaders.clear();
    this.textures.clear();
    this.nothing = null;
  }

  // Shaders

  /** Begins to compile; `linked` waits for it. */
  build(vertex: string, fragment: string): WebGLProgram {
    const { gl } = this;
    const program = gl.createProgram()!;
    for (const [kind, source] of [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ] as const) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, HEAD + source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      this.compilations++;
    }
    gl.linkProgram(program);
    return program;
  }

  linked(name: string, program: WebGLProgram): Shader {
    const { gl } = this;
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = (gl.getAttachedShaders(program) ?? []).map((s) => gl.getShaderInfoLog(s)).join("\n");
      throw new NoWebGL(`The graphics driver refuses a shader: ${logs}${gl.getProgramInfoLog(program)}`);
    }
    const shader = new Shader(gl, program);
    this.shaders.set(name, shader);
    return shader;
  }

  /** The shader of that name, made by `otherwise` where it is needed for the first time. */
  use(name: string, otherwise?: () => WebGLProgram): Shader {
    const shader = this.shaders.get(name) ?? this.linked(name, otherwise!());
    this.gl.useProgram(shader.program);
    return shader;
  }

  // Textures of numbers

  upload(name: string, sort: number, width: number, height: number, format: number, type: number, data: ArrayBufferView): void {
    const { gl } = this;
    if (!this.textures.has(name)) this.textures.set(name, this.newTexture());
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.textures.get(name)!);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, sort, width, height, 0, format, type, data);
  }

  /** Indices, `columns` a row. */
  uploadList(name: string, list: Uint16Array, columns: number): void {
    const { gl } = this;
    const rows = Math.max(1, Math.ceil(list.length / columns));
    const data = new Uint16Array(rows * columns);
    data.set(list);
    this.upload(name, gl.R16UI, columns, rows, gl.RED_INTEGER, gl.UNSIGNED_SHORT, data);
  }

  /** Images (rgba bytes) of one size, one above the other. */
  uploadLayers(name: string, width: number, height: number, layers: number, data: Uint8Array): void {
    const { gl } = this;
    if (!this.textures.has(name)) this.textures.set(name, this.newTexture(gl.TEXTURE_2D_ARRAY));
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.textures.get(name)!);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage3D(gl.TEXTURE_2D_ARRAY, 0, gl.RGBA8, width, height, layers, 0, gl.RGBA, gl.UNSIGNED_BYTE, data);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, null);
  }

  /** By name, at one of the shader's places for textures. */
  texture(shader: Shader, uniform: string, place: number, name = uniform): void {
    this.bind(shader, uniform, place, this.textures.get(name)!);
  }

  bind(shader: Shader, uniform: string, place: number, texture: WebGLTexture): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + place);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(shader.at(uniform), place);
  }

  bindLayers(shader: Shader, uniform: string, place: number): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + place);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.textures.get(uniform)!);
    gl.uniform1i(shader.at(uniform), place);
  }

  private newTexture(kind: number = this.gl.TEXTURE_2D): WebGLTexture {
    const { gl } = this;
    const texture = gl.createTexture()!;
    gl.bindTexture(kind, texture);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(kind, filter, gl.NEAREST);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(kind, wrap, gl.CLAMP_TO_EDGE);
    return texture;
  }

  // Targets

  /** `old` where it has that size already. */
  target(old: Target | null, width: number, height: number, sort: number = this.gl.RGBA32UI, deep = false): Target {
    if (old && old.width === width && old.height === height) return old;
    if (old) this.drop(old);
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0);
    const texture = this.newTexture();
    gl.texStorage2D(gl.TEXTURE_2D, 1, sort, width, height);
    const frame = gl.createFramebuffer()!;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    let depth: WebGLRenderbuffer | null = null;
    if (deep) {
      depth = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    }
    gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
    return { frame, texture, depth, width, height };
  }

  drop(target: Target): void {
    this.gl.deleteFramebuffer(target.frame);
    this.gl.deleteTexture(target.texture);
    if (target.depth) this.gl.deleteRenderbuffer(target.depth);
  }

  /** In which nothing is found; made before anything else is bound. */
  empty(): Target {
    this.nothing ??= this.target(null, 1, 1);
    return this.nothing;
  }
}
