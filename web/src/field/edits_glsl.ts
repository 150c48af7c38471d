/**
 * GLSL of the maps of an edit stack for one sample, equal to `cagefield.edits.device.kernels.edit_maps`.
 *
 * `rows` has the layout of `cagefield.pages.row_layout`. Shells come from lattices of float16, interpolated by the
 * shader: the weights of the GPU's own interpolation have 8 bits.
 */
import { defineNumbers } from "./gl";
import { EDIT_LAYOUT } from "./layout";

const SOURCE = `
${defineNumbers(EDIT_LAYOUT)}
layout(std140) uniform Edits { vec4 rows[MAX_ROWS]; };
uniform sampler2D lattice;
uniform int editCount;
uniform int boxCount;
uniform bool preserveOpacity;

float largest(vec3 v) { return max(max(v.x, v.y), v.z); }

bool inBox(vec3 p, vec3 low, vec3 high) { return all(greaterThanEqual(p, low)) && all(lessThanEqual(p, high)); }

vec3 times(int at, vec3 v) { return vec3(dot(rows[at].xyz, v), dot(rows[at + 1].xyz, v), dot(rows[at + 2].xyz, v)); }

#ifdef BENT
vec3 solveColumns(vec3 u, vec3 v, vec3 w, vec3 r) {
  vec3 vw = cross(v, w);
  float det = dot(u, vw);
  if (abs(det) < 1e-6) det = det >= 0.0 ? 1e-6 : -1e-6;
  return vec3(dot(r, vw), dot(u, cross(r, w)), dot(u, cross(v, r))) / det;
}

vec3 bendSolve(int at, vec3 xi, vec3 r) {
  vec3 a = rows[at].xyz;
  vec3 b = rows[at + 1].xyz;
  vec3 c = rows[at + 2].xyz;
  vec3 g = rows[at + 3].xyz;
  return solveColumns(
    vec3(1.0, 0.0, 0.0) + xi.y * a + xi.z * b + xi.y * xi.z * g,
    vec3(0.0, 1.0, 0.0) + xi.x * a + xi.z * c + xi.x * xi.z * g,
    vec3(0.0, 0.0, 1.0) + xi.x * b + xi.y * c + xi.x * xi.y * g,
    r
  );
}

vec3 bent(int at, vec3 xi) {
  return xi + xi.x * xi.y * rows[at].xyz + xi.x * xi.z * rows[at + 1].xyz + xi.y * xi.z * rows[at + 2].xyz
    + xi.x * xi.y * xi.z * rows[at + 3].xyz;
}
#endif

// Coordinates in the hexahedron at a row, clamped to [-1,1]^3, and the distance by which they were outside.
vec3 hexahedron(vec3 p, int at, out float error) {
  vec3 y = times(at + MATRIX_VECTOR, p - rows[at + CENTER_VECTOR].xyz);
  vec3 xi = y;
  error = 0.0;
#ifdef BENT
  if (rows[at + AFFINE_SCALAR].w < 0.5) {
    if (inBox(y, rows[at + Y_BOX_VECTOR].xyz, rows[at + Y_BOX_VECTOR + 1].xyz)) {
      xi = clamp(y, -1.0, 1.0);
      for (int n = 0; n < 16; n++) {
        vec3 next = clamp(xi - bendSolve(at + BEND_VECTOR, xi, bent(at + BEND_VECTOR, xi) - y), -1.4, 1.4);
        float by = largest(abs(next - xi));
        xi = next;
        if (by < 1e-4) break;
      }
      error = largest(abs(bent(at + BEND_VECTOR, xi) - y));
      if (error < 2e-6) error = 0.0;
    } else {
      error = 10.0;
    }
  }
#endif
  error += max(largest(abs(xi)) - 1.0, 0.0);
  return clamp(xi, -1.0, 1.0);
}

// Takes p and the direction v to canonical space by the coordinates xi in the hexahedron at a row.
void image(vec3 xi, int at, inout vec3 p, inout vec3 v) {
  vec3 along = times(at + MATRIX_VECTOR, v);
  int c = at + IMAGE_VECTOR;
  vec3 c1 = rows[c + 1].xyz;
  vec3 c2 = rows[c + 2].xyz;
  vec3 c4 = rows[c + 4].xyz;
  p = rows[c].xyz + xi.x * c1 + xi.y * c2 + xi.z * c4;
#ifdef BENT
  if (rows[at + AFFINE_SCALAR].w < 0.5) {
    along = bendSolve(at + BEND_VECTOR, xi, along);
    vec3 c3 = rows[c + 3].xyz;
    vec3 c5 = rows[c + 5].xyz;
    vec3 c6 = rows[c + 6].xyz;
    vec3 c7 = rows[c + 7].xyz;
    p += xi.x * xi.y * c3 + xi.x * xi.z * c5 + xi.y * xi.z * c6 + xi.x * xi.y * xi.z * c7;
    c1 += xi.y * c3 + xi.z * c5 + xi.y * xi.z * c7;
    c2 += xi.x * c3 + xi.z * c6 + xi.x * xi.z * c7;
    c4 += xi.x * c5 + xi.y * c6 + xi.x * xi.y * c7;
  }
#endif
  v = along.x * c1 + along.y * c2 + along.z * c4;
}

vec3 node(int n) { return texelFetch(lattice, ivec2(n & (NODES_PER_TEXTURE_ROW - 1), n >> ${Math.log2(EDIT_LAYOUT.NODES_PER_TEXTURE_ROW)}), 0).xyz; }

void interpolate(int e, int resolution_, vec3 at, inout vec3 p, inout vec3 v) {
  vec3 s = times(e + TO_NODES_VECTOR, v);
  vec3 g = clamp(at, 0.0, float(resolution_ - 1));
  ivec3 cell = min(ivec3(g), resolution_ - 2);
  vec3 f = g - vec3(cell);
  int plane = resolution_ * resolution_;
  int n = int(rows[e + NODE_SCALAR].w) + (cell.z * resolution_ + cell.y) * resolution_ + cell.x;
  vec3 v000 = node(n);
  vec3 v010 = node(n + resolution_);
  vec3 v001 = node(n + plane);
  vec3 v011 = node(n + plane + resolution_);
  vec3 x00 = node(n + 1) - v000;
  vec3 x10 = node(n + resolution_ + 1) - v010;
  vec3 x01 = node(n + plane + 1) - v001;
  vec3 x11 = node(n + plane + resolution_ + 1) - v011;
  vec3 w00 = v000 + f.x * x00;
  vec3 w10 = v010 + f.x * x10;
  vec3 w01 = v001 + f.x * x01;
  vec3 w11 = v011 + f.x * x11;
  vec3 y0 = w10 - w00;
  vec3 y1 = w11 - w01;
  vec3 z0 = w00 + f.y * y0;
  vec3 z1 = w01 + f.y * y1;
  vec3 x0 = x00 + f.y * (x10 - x00);
  vec3 x1 = x01 + f.y * (x11 - x01);
  p += z0 + f.z * (z1 - z0);
  v += s.x * (x0 + f.z * (x1 - x0)) + s.y * (y0 + f.z * (y1 - y0)) + s.z * (z1 - z0);
}

// Maps a sample through the edit whose rows begin at e. Returns the offset along x, in vertices, at which the sample is
// read: 0 in the field, the offset of a layer, or -1 for an empty sample.
int mapEdit(int e, inout vec3 p, inout vec3 v) {
  bool continuous = rows[e + CONTINUOUS_SCALAR].w > 0.5;
  int resolution_ = int(rows[e + RESOLUTION_SCALAR].w);
  int first = e + HEXAHEDRON;
  if (rows[e + SIMPLE_SCALAR].w > 0.5) {
    vec3 y = times(first + MATRIX_VECTOR, p - rows[first + CENTER_VECTOR].xyz);
    if (largest(abs(y)) <= 1.0 + EDGE) {
      image(clamp(y, -1.0, 1.0), first, p, v);
      return 0;
    }
    vec3 at = times(e + TO_NODES_VECTOR, p - rows[e + LATTICE_VECTOR].xyz);
    if (inBox(at, rows[e + NODE_BOX_VECTOR].xyz, rows[e + NODE_BOX_VECTOR + 1].xyz)) interpolate(e, resolution_, at, p, v);
    return 0;
  }
  float error;
  if (rows[e + FIRST_SCALAR].w < 0.5) {
    vec3 xi = hexahedron(p, first, error);
    if (error <= EDGE) {
      image(xi, first, p, v);
      return int(rows[e + PART_SCALAR].w);
    }
  }
  if (rows[e + LAST_SCALAR].w < 1.5) return 0;
  hexahedron(p, first + HEXAHEDRON_ROWS, error);
  if (!continuous) return error <= EDGE ? int(rows[e + UNDER_SCALAR].w) : 0;
  if (error <= EDGE) interpolate(e, resolution_, times(e + TO_NODES_VECTOR, p - rows[e + LATTICE_VECTOR].xyz), p, v);
  return 0;
}

MAP_SAMPLE
#ifdef GRADED
// Number k of the grade of the edit whose rows begin at e.
float gradeNumber(int e, int k) { return rows[e + GRADE_SCALARS + (k < GRADE_FIRST_PART ? k : k + 1)].w; }

vec3 gradeVector(int e, int k) { return vec3(gradeNumber(e, k), gradeNumber(e, k + 1), gradeNumber(e, k + 2)); }

// Coordinates in the frame at number k, without signs, and the distances of its pairs of faces from its center.
vec3 framed(int e, int k, vec3 q, out vec3 half_) {
  vec3 by = q - gradeVector(e, k + 9);
  vec3 x = gradeVector(e, k);
  vec3 y = gradeVector(e, k + 3);
  vec3 z = gradeVector(e, k + 6);
  half_ = 1.0 / vec3(length(x), length(y), length(z));
  return abs(vec3(dot(x, by), dot(y, by), dot(z, by)));
}

float falloffWeight(int e, vec3 q) {
  vec3 h;
  vec3 H;
  vec3 xi = framed(e, GRADE_INNER, q, h);
  if (largest(xi) <= 1.0) return 1.0;
  vec3 z = framed(e, GRADE_OUTER, q, H);
  if (largest(z) >= 1.0) return 0.0;
  vec3 a = h * max(xi - 1.0, 0.0);
  vec3 b = 0.5 * H * max(1.0 - z * z, 1e-6);
  a *= a;
  b *= b;
  float inner = sqrt(sqrt(dot(a, a)));
  float outer = inversesqrt(sqrt(dot(1.0 / b, 1.0 / b)));
  float g = outer / (inner + outer);
  return g * g * (3.0 - 2.0 * g);
}

// The matrix of a sample's color by the edits' grades, and the factor of its density.
mat3 gradeSample(vec3 p, out float density) {
  mat3 colors = mat3(1.0);
  density = 1.0;
  int place = 0;
  vec3 v = vec3(0.0, 0.0, 1.0);
  for (int n = editCount - 1; n >= 0; n--) {
    int e = n * EDIT_ROWS;
    if (place != 0 || !inBox(p, rows[e + BOX_VECTOR].xyz, rows[e + BOX_VECTOR + 1].xyz)) continue;
    bool graded = gradeNumber(e, GRADE_DENSITY) > 0.5;
    bool continuous = rows[e + CONTINUOUS_SCALAR].w > 0.5;
    float weight = 0.0;
    if (graded && !continuous && rows[e + FIRST_SCALAR].w < 0.5) {
      float error;
      hexahedron(p, e + HEXAHEDRON, error);
      if (error <= EDGE) weight = 1.0;
    }
    place = mapEdit(e, p, v);
    if (graded && continuous) weight = falloffWeight(e, p);
    if (weight > 0.0) {
      mat3 step_ = transpose(mat3(gradeVector(e, 0), gradeVector(e, 3), gradeVector(e, 6)));
      colors = colors * (mat3(1.0) + weight * (step_ - mat3(1.0)));
      density *= 1.0 + weight * (gradeNumber(e, GRADE_DENSITY) - 2.0);
    }
  }
  return colors;
}
#endif
// The interval of a ray outside which no edit has an effect.
vec2 editedPart(vec3 origin, vec3 d) {
  vec2 part = vec2(1e30, -1e30);
  vec3 inverse_ = safeInverse(d);
  for (int k = 0; k < boxCount; k++) {
    int at = editCount * EDIT_ROWS + BOX_ROWS * k;
    vec2 through = slab(origin, inverse_, rows[at].xyz, rows[at + 1].xyz);
    if (through.x <= through.y) part = vec2(min(part.x, through.x), max(part.y, through.y));
  }
  return part;
}

vec3 throughEdits(vec3 slope, vec3 p) {
  vec3 result;
  for (int a = 0; a < 3; a++) {
    vec3 q = p;
    vec3 v = vec3(a == 0, a == 1, a == 2);
    mapSample(q, v);
    result[a] = dot(slope, v);
  }
  return result;
}
`;

/**
 * Number of edits up to which the loop is unrolled: constant indices are 1.7 times as fast in software, and
 * faster on GPUs.
 */
const MAX_UNROLLED_EDITS = 2;

/** Number of edits of an unrolled shader; null for a shader with a loop. */
export function unrolledEdits(edits: number): number | null {
  return edits <= MAX_UNROLLED_EDITS ? edits : null;
}

/** Whether an edit of a page grades colors: the shader leaves the code out where none does. */
export function isGraded(rows: Float32Array, edits: number): boolean {
  const at = EDIT_LAYOUT.GRADE_SCALARS + EDIT_LAYOUT.GRADE_DENSITY;
  for (let e = 0; e < edits; e++) if (rows[4 * (e * EDIT_LAYOUT.EDIT_ROWS + at) + 3] > 0.5) return true;
  return false;
}

/** Whether samples go through a cage that is no parallelepiped: the shader has Newton's iteration only then. */
export function isBent(rows: Float32Array, edits: number): boolean {
  const { EDIT_ROWS, HEXAHEDRON, HEXAHEDRON_ROWS, AFFINE_SCALAR } = EDIT_LAYOUT;
  const scalar = (row: number): number => rows[4 * row + 3] ?? 0;
  for (let e = 0; e < edits * EDIT_ROWS; e += EDIT_ROWS) {
    if (scalar(e + EDIT_LAYOUT.SIMPLE_SCALAR) > 0.5) continue;
    const affine = [0, HEXAHEDRON_ROWS].map((at) => scalar(e + HEXAHEDRON + at + AFFINE_SCALAR) > 0.5);
    if (scalar(e + EDIT_LAYOUT.FIRST_SCALAR) < 0.5 && !affine[0]) return true;
    if (scalar(e + EDIT_LAYOUT.LAST_SCALAR) > 1.5 && !affine[1]) return true;
  }
  return false;
}

/** GLSL source for a number of edits; see `unrolledEdits`. */
export function editsSource(count: number | null): string {
  const one = (e: string): string =>
    `if (place == 0 && inBox(p, rows[${e} + BOX_VECTOR].xyz, rows[${e} + BOX_VECTOR + 1].xyz)) place = mapEdit(${e}, p, v);`;
  const all =
    count === null
      ? [`for (int n = editCount - 1; n >= 0; n--) { ${one("n * EDIT_ROWS")} }`]
      : Array.from({ length: count }, (_, n) => one(`${count - 1 - n} * EDIT_ROWS`));
  const body = [
    "int mapSample(inout vec3 p, inout vec3 v) {",
    "  int place = 0;",
    ...all.map((line) => `  ${line}`),
    "  return place;",
    "}",
  ];
  return SOURCE.replace("MAP_SAMPLE", `${body.join("\n")}\n`);
}
