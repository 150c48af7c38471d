/** Helpers for WebGL2: programs, textures, memory checks, limits. */

type GL = WebGL2RenderingContext;

/** Definitions of numbers for GLSL, one line each. */
export function defineNumbers(numbers: Readonly<Record<string, number>>): string {
  return Object.entries(numbers)
    .map(([name, value]) => `#define ${name} ${value}`)
    .join("\n");
}

/** A linked program, the locations of its uniforms, and the milliseconds of its compilation. */
export interface Program {
  program: WebGLProgram;
  uniform: (name: string) => WebGLUniformLocation | null;
  milliseconds: number;
}

export function createProgram(gl: GL, vertex: string, fragment: string): Program {
  const began = performance.now();
  const program = gl.createProgram();
  for (const [type, source] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ] as const) {
    const shader = gl.createShader(type);
    if (shader === null) throw new Error("the GPU's context is lost");
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const shaders = gl.getAttachedShaders(program) ?? [];
    const logs = shaders.map((shader) => gl.getShaderInfoLog(shader) ?? "");
    throw new Error(`a shader does not compile: ${logs.join(" ")} ${gl.getProgramInfoLog(program) ?? ""}`);
  }
  const places = new Map<string, WebGLUniformLocation | null>();
  const uniform = (name: string): WebGLUniformLocation | null => {
    const known = places.get(name);
    if (known !== undefined) return known;
    const place = gl.getUniformLocation(program, name);
    places.set(name, place);
    return place;
  };
  return { program, uniform, milliseconds: performance.now() - began };
}

/** Error: the GPU has not enough memory. */
export class OutOfMemory extends Error {
  constructor() {
    super("the GPU has not enough memory for the field");
  }
}

/** Throws `OutOfMemory` if a command since the last check exceeded the memory of the GPU. */
export function checkMemory(gl: GL): void {
  for (
    let error = gl.getError();
    error !== gl.NO_ERROR && error !== gl.CONTEXT_LOST_WEBGL;
    error = gl.getError()
  )
    if (error === gl.OUT_OF_MEMORY) throw new OutOfMemory();
}

/** An empty 3D texture; throws `OutOfMemory` beyond the memory of the GPU. */
export function texture3D(gl: GL, format: number, size: readonly number[], filter: number): WebGLTexture {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_3D, texture);
  gl.texStorage3D(gl.TEXTURE_3D, 1, format, size[0], size[1], size[2]);
  setFilter(gl, gl.TEXTURE_3D, filter);
  try {
    checkMemory(gl);
  } catch (error) {
    gl.deleteTexture(texture);
    throw error;
  }
  return texture;
}

/** Sets filtering without mipmaps, clamped to the edges. */
export function setFilter(gl: GL, target: number, filter: number): void {
  gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, filter);
  for (const axis of target === gl.TEXTURE_3D
    ? [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]
    : [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
    gl.texParameteri(target, axis, gl.CLAMP_TO_EDGE);
}

/** Resets the unpacking of pixels, which other users of the context may have changed. */
export function resetUnpacking(gl: GL): void {
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
  gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
  gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
  for (const name of [
    gl.UNPACK_ROW_LENGTH,
    gl.UNPACK_IMAGE_HEIGHT,
    gl.UNPACK_SKIP_PIXELS,
    gl.UNPACK_SKIP_ROWS,
    gl.UNPACK_SKIP_IMAGES,
  ])
    gl.pixelStorei(name, 0);
}

/**
 * A limit of the GPU, such as its largest texture. A lost context has no limits; all uploads are repeated once it is
 * restored.
 */
export function deviceLimit(gl: GL, limit: GLenum): number {
  return (gl.getParameter(limit) as number | null) ?? 1 << 14;
}
