(function(){"use strict";function ee(r){return Object.entries(r).map(([e,t])=>`#define ${e} ${t}`).join(`
`)}function F(r,e,t){const s=performance.now(),n=r.createProgram();for(const[a,c]of[[r.VERTEX_SHADER,e],[r.FRAGMENT_SHADER,t]]){const l=r.createShader(a);if(l===null)throw new Error("the GPU's context is lost");r.shaderSource(l,c),r.compileShader(l),r.attachShader(n,l),r.deleteShader(l)}if(r.linkProgram(n),!r.getProgramParameter(n,r.LINK_STATUS)&&!r.isContextLost()){const c=(r.getAttachedShaders(n)??[]).map(l=>r.getShaderInfoLog(l)??"");throw new Error(`a shader does not compile: ${c.join(" ")} ${r.getProgramInfoLog(n)??""}`)}const o=new Map;return{program:n,uniform:a=>{const c=o.get(a);if(c!==void 0)return c;const l=r.getUniformLocation(n,a);return o.set(a,l),l},milliseconds:performance.now()-s}}class be extends Error{constructor(){super("the GPU has not enough memory for the field")}}function j(r){for(let e=r.getError();e!==r.NO_ERROR&&e!==r.CONTEXT_LOST_WEBGL;e=r.getError())if(e===r.OUT_OF_MEMORY)throw new be}function L(r,e,t,s){const n=r.createTexture();r.bindTexture(r.TEXTURE_3D,n),r.texStorage3D(r.TEXTURE_3D,1,e,t[0],t[1],t[2]),Y(r,r.TEXTURE_3D,s);try{j(r)}catch(o){throw r.deleteTexture(n),o}return n}function Y(r,e,t){r.texParameteri(e,r.TEXTURE_MIN_FILTER,t),r.texParameteri(e,r.TEXTURE_MAG_FILTER,t);for(const s of e===r.TEXTURE_3D?[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T,r.TEXTURE_WRAP_R]:[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T])r.texParameteri(e,s,r.CLAMP_TO_EDGE)}function N(r){r.bindBuffer(r.PIXEL_UNPACK_BUFFER,null),r.pixelStorei(r.UNPACK_ALIGNMENT,1),r.pixelStorei(r.UNPACK_FLIP_Y_WEBGL,!1),r.pixelStorei(r.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),r.pixelStorei(r.UNPACK_COLORSPACE_CONVERSION_WEBGL,r.NONE);for(const e of[r.UNPACK_ROW_LENGTH,r.UNPACK_IMAGE_HEIGHT,r.UNPACK_SKIP_PIXELS,r.UNPACK_SKIP_ROWS,r.UNPACK_SKIP_IMAGES])r.pixelStorei(e,0)}function te(r,e){return r.getParameter(e)??16384}const b={BOX_VECTOR:0,LATTICE_VECTOR:2,TO_NODES_VECTOR:3,NODE_BOX_VECTOR:6,FIRST_SCALAR:0,LAST_SCALAR:1,RESOLUTION_SCALAR:2,CONTINUOUS_SCALAR:3,SIMPLE_SCALAR:4,UNDER_SCALAR:5,NODE_SCALAR:6,PART_SCALAR:7,HEXAHEDRON:8,MATRIX_VECTOR:0,CENTER_VECTOR:3,Y_BOX_VECTOR:4,BEND_VECTOR:6,IMAGE_VECTOR:10,AFFINE_SCALAR:0,HEXAHEDRON_ROWS:18,GRADE_SCALARS:9,GRADE_DENSITY:9,GRADE_INNER:10,GRADE_OUTER:22,GRADE_COUNT:34,GRADE_FIRST_PART:17,EDIT_ROWS:44,BOX_ROWS:2,MAX_ROWS:1024,NODES_PER_TEXTURE_ROW:2048,EDGE:1e-6},Ae={BLUR:.3,SLOPE_BLUR:.02,ALPHA_MIN:.00392156862745098,ALPHA_MAX:.99,LEAST_COMPENSATION:.005},Lt=`
${ee(b)}
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

vec3 node(int n) { return texelFetch(lattice, ivec2(n & (NODES_PER_TEXTURE_ROW - 1), n >> ${Math.log2(b.NODES_PER_TEXTURE_ROW)}), 0).xyz; }

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
`,Bt=2;function It(r){return r<=Bt?r:null}function zt(r,e){const t=b.GRADE_SCALARS+b.GRADE_DENSITY;for(let s=0;s<e;s++)if(r[4*(s*b.EDIT_ROWS+t)+3]>.5)return!0;return!1}function Pt(r,e){const{EDIT_ROWS:t,HEXAHEDRON:s,HEXAHEDRON_ROWS:n,AFFINE_SCALAR:o}=b,i=a=>r[4*a+3]??0;for(let a=0;a<e*t;a+=t){if(i(a+b.SIMPLE_SCALAR)>.5)continue;const c=[0,n].map(l=>i(a+s+l+o)>.5);if(i(a+b.FIRST_SCALAR)<.5&&!c[0]||i(a+b.LAST_SCALAR)>1.5&&!c[1])return!0}return!1}function Xt(r){const e=n=>`if (place == 0 && inBox(p, rows[${n} + BOX_VECTOR].xyz, rows[${n} + BOX_VECTOR + 1].xyz)) place = mapEdit(${n}, p, v);`,s=["int mapSample(inout vec3 p, inout vec3 v) {","  int place = 0;",...(r===null?[`for (int n = editCount - 1; n >= 0; n--) { ${e("n * EDIT_ROWS")} }`]:Array.from({length:r},(n,o)=>e(`${r-1-o} * EDIT_ROWS`))).map(n=>`  ${n}`),"  return place;","}"];return Lt.replace("MAP_SAMPLE",`${s.join(`
`)}
`)}const{MAX_ROWS:_e,NODES_PER_TEXTURE_ROW:K}=b;class Gt{constructor(e){this.gl=e}uploaded={last:0,total:0};current=null;buffer=null;lattices=null;occupancy=null;get edits(){return this.current}get bricks(){return this.occupancy?.texture??null}countUpload(e){this.uploaded.last+=e,this.uploaded.total+=e}set(e){if(this.uploaded.last=0,e===null||e.edits===0){this.dispose();return}if(e.rows.length>4*_e)throw new Error("more edits than the page's shader holds");this.putRows(e),this.putLattices(e),this.putOccupancy(e),this.current=e,this.uploaded.total+=this.uploaded.last}bind(e){const{gl:t}=this;return t.uniformBlockBinding(e,t.getUniformBlockIndex(e,"Edits"),0),t.bindBufferBase(t.UNIFORM_BUFFER,0,this.buffer),this.lattices?.texture??null}forget(){this.current=this.buffer=this.lattices=this.occupancy=null}dispose(){const{gl:e}=this;e.deleteBuffer(this.buffer),e.deleteTexture(this.lattices?.texture??null),e.deleteTexture(this.occupancy?.texture??null),this.forget()}putRows({rows:e}){const{gl:t}=this,s=this.buffer===null;this.buffer??=t.createBuffer(),t.bindBuffer(t.UNIFORM_BUFFER,this.buffer),s&&t.bufferData(t.UNIFORM_BUFFER,16*_e,t.DYNAMIC_DRAW),t.bufferSubData(t.UNIFORM_BUFFER,0,e),t.bindBuffer(t.UNIFORM_BUFFER,null),this.uploaded.last+=e.byteLength}putLattices({lattices:e}){const{gl:t}=this,s=e.map(({halves:c})=>Math.ceil(c.length/(3*K))),n=Math.max(1,s.reduce((c,l)=>c+l,0));if(n>te(t,t.MAX_TEXTURE_SIZE))throw new Error("the edits' lattices do not fit into a texture of the GPU");(this.lattices===null||n>this.lattices.rows)&&(t.deleteTexture(this.lattices?.texture??null),this.lattices={texture:this.latticeTexture(n),rows:n,placed:[]});const{texture:o,placed:i}=this.lattices;N(t),t.bindTexture(t.TEXTURE_2D,o);let a=0;this.lattices.placed=e.map(({key:c,halves:l},h)=>{const u={key:c,row:a};if(i.every(d=>d.key!==c||d.row!==u.row)){const d=3*K*s[h],f=l.length===d?l:new Uint16Array(d);f!==l&&f.set(l),t.texSubImage2D(t.TEXTURE_2D,0,0,a,K,s[h],t.RGB,t.HALF_FLOAT,f),this.uploaded.last+=f.byteLength}return a+=s[h],u}),t.bindTexture(t.TEXTURE_2D,null),j(t)}latticeTexture(e){const{gl:t}=this,s=t.createTexture();return t.bindTexture(t.TEXTURE_2D,s),t.texStorage2D(t.TEXTURE_2D,1,t.RGB16F,K,e),Y(t,t.TEXTURE_2D,t.NEAREST),s}putOccupancy({occupancy:{key:e,dims:t,codes:s,changed:n}}){const{gl:o,occupancy:i}=this;if(i?.key===e)return;N(o);const a=i!==null&&i.dims.every((f,m)=>f===t[m]);a||o.deleteTexture(i?.texture??null);const c=a?i.texture:L(o,o.R16UI,[t[2],t[1],t[0]],o.NEAREST),l=a&&n?.of===i.key?n:{low:[0,0,0],dims:t,codes:s};o.bindTexture(o.TEXTURE_3D,c);const[h,u,d]=l.low;o.texSubImage3D(o.TEXTURE_3D,0,d,u,h,l.dims[2],l.dims[1],l.dims[0],o.RED_INTEGER,o.UNSIGNED_SHORT,l.codes),o.bindTexture(o.TEXTURE_3D,null),this.occupancy={texture:c,key:e,dims:t},this.uploaded.last+=l.codes.byteLength}}class B{constructor(e,t=()=>{}){this.onArrival=t,this.source=(e instanceof ArrayBuffer?new Blob([e]).stream():e).getReader()}chunks=[];buffered=0;arrived=0;source;async take(e){for(;this.buffered<e;){const{value:n,done:o}=await this.source.read();if(o)throw new Error("the file of the field is truncated");this.chunks.push(n),this.buffered+=n.length,this.arrived+=n.length,this.onArrival(this.arrived)}const t=new Uint8Array(e);let s=0;for(;s<e;){const n=this.chunks[0],o=n.subarray(0,e-s);t.set(o,s),s+=o.length,o.length===n.length?this.chunks.shift():this.chunks[0]=n.subarray(o.length)}return this.buffered-=e,t}cancel(){this.source.cancel().catch(()=>{})}}async function $t(r){const e=new Blob([r]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(e).arrayBuffer()}class C{constructor(e,t,s){this.header=e,this.entries=t,this.reader=s}next=0;static async open(e,t,s){const n=await e.take(16),o=new DataView(n.buffer);if(String.fromCharCode(...n.subarray(0,8))!==t)throw new Error(`not a file of the kind "${t}"`);const i=o.getUint32(8,!0);if(i!==s)throw new Error(`"${t}" of version ${i}, this page reads ${s}; reload it`);const a=new TextDecoder().decode(await e.take(o.getUint32(12,!0))),c=JSON.parse(a);return new C(c,c.arrays,e)}get left(){return this.entries.slice(this.next).reduce((e,t)=>e+t.bytes,0)}async read(e){const t=this.entries.at(this.next);if(t?.name!==e)throw new Error(`the file of the field has no array "${e}" here`);this.next++;const s=await $t(await this.reader.take(t.bytes));switch(t.type){case"u1":return new Uint8Array(s);case"u2":return new Uint16Array(s);case"i4":return new Int32Array(s);case"f4":return new Float32Array(s)}}}const Wt="cagepage",Ht=1;async function*Vt(r,e){const t=new B(r,e);try{const s=await C.open(t,Wt,Ht);for(const[n,o]of s.header.levels.entries()){const i=await s.read(`${n}.bricks`),a=await s.read(`${n}.masks`),c=await s.read(`${n}.occupancy`),l=await Se(s,`${n}`);yield{field:s.header,header:o,last:n===s.header.levels.length-1,bricks:i,masks:a,...l,occupancy:{origin:[0,0,0],dims:o.dims,codes:c}}}}finally{t.cancel()}}async function Se(r,e){const t=se(await r.read(`${e}.density`));return{density:t,sh:qt(await r.read(`${e}.sh`),t.length)}}function se(r){const e=r.length/2,t=new Uint16Array(e);for(let s=0;s<e;s++)t[s]=r[s]|r[e+s]<<8;return t}function qt(r,e){if(e===0)return r;for(let t=0;t<r.length;t+=e){let s=128;for(let n=t;n<t+e;n++)r[n]=s=s+r[n]&255}return r}const re=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.y * (3.0 * d.x * d.x - d.y * d.y)","2.890611442640554 * d.x * d.y * d.z","-0.4570457994644658 * d.y * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","0.3731763325901154 * d.z * (2.0 * d.z * d.z - 3.0 * d.x * d.x - 3.0 * d.y * d.y)","-0.4570457994644658 * d.x * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","1.445305721320277 * d.z * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.x * (d.x * d.x - 3.0 * d.y * d.y)","2.5033429417967046 * d.x * d.y * (d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.y * d.z * (3.0 * d.x * d.x - d.y * d.y)","0.9461746957575601 * d.x * d.y * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-0.6690465435572892 * d.y * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.10578554691520431 * (8.0 * d.z * d.z * d.z * d.z - 24.0 * d.z * d.z * (d.x * d.x + d.y * d.y) + 3.0 * (d.x * d.x + d.y * d.y) * (d.x * d.x + d.y * d.y))","-0.6690465435572892 * d.x * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.47308734787878004 * (d.x * d.x - d.y * d.y) * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.x * d.z * (d.x * d.x - 3.0 * d.y * d.y)","0.6258357354491761 * (d.x * d.x * (d.x * d.x - 3.0 * d.y * d.y) - d.y * d.y * (3.0 * d.x * d.x - d.y * d.y))"];function jt(r){const e=Math.ceil(3*r/4),t=[`uniform float coefficientSteps[${r}];`,...Array.from({length:e},(s,n)=>`uniform sampler3D colorAtlas${n};`),"vec3 colorAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:e},(s,n)=>`  vec4 s${n} = 255.0 * textureLod(colorAtlas${n}, at, 0.0) - 128.0;`)];for(let s=0;s<r;s++){const n=[0,1,2].map(o=>`s${3*s+o>>2}.${"xyzw"[3*s+o&3]}`);t.push(`  rgb += (coefficientSteps[${s}] * (${re[s]})) * vec3(${n.join(", ")});`)}return{source:[...t,"  return rgb;","}"].join(`
`),colors:e}}const Yt=`
uniform sampler3D densityAtlas;
uniform usampler3D brickIndex;
uniform usampler3D bricks;
uniform vec3 atlasScale;
uniform ivec3 indexDims;
uniform ivec3 bricksOrigin;
uniform ivec3 bricksDims;
uniform ivec3 resolution;
uniform vec3 lower;
uniform vec3 scale;
uniform vec3 halfGrid;
uniform float unit;
uniform float marchStep;
uniform float near;
uniform vec3 background;
uniform vec3 eye;
uniform mat3 rotation;
uniform vec4 lens;
uniform float height;
uniform bool layered;
layout(location = 0) out vec4 outColor;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
layout(location = 2) out vec4 outNormal;
#endif

vec3 contract(vec3 q) {
  float m = max(max(max(abs(q.x), abs(q.y)), abs(q.z)), 1.0);
  return ((2.0 - 1.0 / m) / m) * q;
}

vec3 contractVelocity(vec3 q, vec3 d) {
  vec3 a = abs(q);
  float m = max(max(a.x, a.y), a.z);
  if (m <= 1.0) return d;
  float dm = d.x * sign(q.x);
  if (a.y >= m) dm = d.y * sign(q.y);
  if (a.z >= m) dm = d.z * sign(q.z);
  return ((2.0 - 1.0 / m) / m) * d + ((-2.0 + 2.0 / m) / (m * m)) * dm * q;
}

vec2 slab(vec3 origin, vec3 inverse_, vec3 low, vec3 high) {
  vec3 a = (low - origin) * inverse_;
  vec3 b = (high - origin) * inverse_;
  vec3 first = min(a, b);
  vec3 last = max(a, b);
  return vec2(max(max(first.x, first.y), first.z), min(min(last.x, last.y), last.z));
}

vec3 safeInverse(vec3 d) { return 1.0 / mix(d, vec3(1e-12), lessThan(abs(d), vec3(1e-12))); }

float emptyRun(vec3 g, vec3 inverse_) {
  ivec3 cell = ivec3(floor(g)) - bricksOrigin;
  ivec3 b = clamp(cell >> 2, ivec3(0), bricksDims - 1);
  int code = int(texelFetch(bricks, b.zyx, 0).r);
  ivec3 low;
  int size;
  if (code >= 256) {
    int d = code >> 8;
    low = (b - (d - 1)) * 4;
    size = (2 * d - 1) * 4;
  } else {
    ivec3 s = (cell >> 1) & 1;
    if (((code >> (s.x * 4 + s.y * 2 + s.z)) & 1) == 1) return -1.0;
    low = (cell >> 1) << 1;
    size = 2;
  }
  vec3 lo = vec3(low + bricksOrigin);
  vec3 last = max((lo - g) * inverse_, (lo + float(size) - g) * inverse_);
  return max(min(min(last.x, last.y), last.z), 0.0);
}

vec3 toGrid(vec3 p) {
  vec3 g = (p - lower) * scale;
#ifdef CONTRACTED
  g = (contract(g) + 2.0) * halfGrid;
#endif
  return g;
}

// Texel coordinates in the atlas, whole numbers at vertices, of grid coordinates in the field, or in the layer at an
// offset; false for an empty brick.
bool locate(vec3 g, int place, out vec3 texel, out ivec3 corner) {
  vec3 inside = clamp(g, vec3(0.0), vec3(resolution - 1));
  ivec3 b = min(ivec3(inside) / BRICK, indexDims - 1);
  uvec4 entry = texelFetch(brickIndex, ivec3(b.zy, b.x + place / BRICK), 0);
  corner = ivec3(entry.xyz) * (BRICK + 1);
  texel = vec3(corner) + (inside - vec3(b * BRICK)).zyx;
  return entry.a > 0u;
}

// Gradient of the interpolated density in grid coordinates.
vec3 densitySlope(vec3 texel, ivec3 corner) {
  ivec3 cell = corner + min(ivec3(texel) - corner, ivec3(BRICK - 1));
  vec3 f = texel - vec3(cell);
  vec3 e = 1.0 - f;
  float r000 = texelFetch(densityAtlas, cell, 0).r;
  float r100 = texelFetch(densityAtlas, cell + ivec3(1, 0, 0), 0).r;
  float r010 = texelFetch(densityAtlas, cell + ivec3(0, 1, 0), 0).r;
  float r110 = texelFetch(densityAtlas, cell + ivec3(1, 1, 0), 0).r;
  float r001 = texelFetch(densityAtlas, cell + ivec3(0, 0, 1), 0).r;
  float r101 = texelFetch(densityAtlas, cell + ivec3(1, 0, 1), 0).r;
  float r011 = texelFetch(densityAtlas, cell + ivec3(0, 1, 1), 0).r;
  float r111 = texelFetch(densityAtlas, cell + ivec3(1, 1, 1), 0).r;
  return vec3(
    (r001 - r000) * e.x * e.y + (r101 - r100) * f.x * e.y + (r011 - r010) * e.x * f.y + (r111 - r110) * f.x * f.y,
    (r010 - r000) * e.x * e.z + (r110 - r100) * f.x * e.z + (r011 - r001) * e.x * f.z + (r111 - r101) * f.x * f.z,
    (r100 - r000) * e.y * e.z + (r110 - r010) * f.y * e.z + (r101 - r001) * e.y * f.z + (r111 - r011) * f.y * f.z
  ) * unit;
}

vec3 pullBack(vec3 slope, vec3 q) {
  return vec3(
    dot(slope, contractVelocity(q, vec3(1.0, 0.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 1.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 0.0, 1.0)))
  );
}
`,Kt=`
// Rounded here, and centered in the step of 8 bits: some GPUs truncate and others round.
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }

void main() {
  vec2 pixel = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec3 d = rotation * normalize(vec3((pixel - lens.zw) / lens.xy * vec2(1.0, -1.0), -1.0));
  vec3 go = (eye - lower) * scale;
  vec3 gd = d * scale;
  vec3 inverse_ = safeInverse(gd);
  float t = near;
  float end = 1e30;
#ifndef CONTRACTED
  vec3 lo = vec3(bricksOrigin);
  vec2 hit = slab(go, inverse_, lo, lo + 4.0 * vec3(bricksDims));
  t = max(hit.x, near) + 0.5 * marchStep;
  end = hit.y;
#endif
#ifdef EDITED
  vec2 edited = editedPart(eye, d);
#endif
  float T = 1.0;
  vec3 rgb = vec3(0.0);
  vec3 normal = vec3(0.0);
  float depth = 0.0;
#ifdef COUNT
  int samples = 0;
  int reads = 0;
#endif
  while (t < end && T > 1e-3) {
    vec3 g = go + t * gd;
    float h = marchStep;
    float leap = 0.0;
#ifdef CONTRACTED
    vec3 q = g;
    vec3 v = contractVelocity(q, gd) * halfGrid;
    g = (contract(q) + 2.0) * halfGrid;
    h = marchStep / max(max(abs(v.x), abs(v.y)), abs(v.z));
    float m = max(max(abs(q.x), abs(q.y)), abs(q.z));
    if (m > 2.0 * halfGrid.x) end = t;
    float run = emptyRun(g, safeInverse(v));
    if (run >= 0.0) {
      leap = m > 1.0 ? min(0.5 * run, 0.25 * m / max(max(abs(gd.x), abs(gd.y)), abs(gd.z))) : run + 0.5 * h;
      leap = max(leap, h);
    }
#else
    float run = emptyRun(g, inverse_);
    if (run >= 0.0) leap = (floor(run / marchStep) + 1.0) * marchStep;
#endif
#ifdef COUNT
    reads += 1;
#endif
    if (run >= 0.0) {
      t += leap;
      continue;
    }
    bool alive = true;
    bool moved = false;
    int place = 0;
    vec3 view = d;
#ifdef EDITED
    if (t >= edited.x && t <= edited.y) {
      vec3 p = eye + t * d;
      vec3 canonical = p;
      place = mapSample(canonical, view);
      vec3 by = abs(canonical - p);
      moved = max(max(by.x, by.y), by.z) > 0.0;
      if (place < 0) alive = false;
      else if (!layered) place = 0;
      if (moved) g = toGrid(canonical);
    }
#endif
    vec3 texel;
    ivec3 corner;
    alive = alive && all(greaterThanEqual(g, vec3(-1e-3))) && all(lessThanEqual(g, vec3(resolution - 1) + 1e-3));
    if (alive && locate(g, place, texel, corner)) {
      vec3 at = (texel + 0.5) * atlasScale;
      float raw = textureLod(densityAtlas, at, 0.0).r * unit;
#ifdef COUNT
      samples += 1;
      reads += 2;
#endif
      if (raw > 0.0) {
#ifdef EDITED
        if (moved && preserveOpacity) raw *= length(view);
#endif
#ifdef GRADED
        mat3 grade = mat3(1.0);
        if (t >= edited.x && t <= edited.y) {
          float thickness;
          grade = gradeSample(eye + t * d, thickness);
          raw *= thickness;
        }
#endif
        float keep = exp(-raw * h);
        float w = T * (1.0 - keep);
        T *= keep;
        if (w > 1e-4) {
          vec3 c = colorAt(at, view / max(length(view), 1e-20));
#ifdef COUNT
          reads += COLORS;
#endif
          c = clamp(c, 0.0, 1.0);
#ifdef GRADED
          c = clamp(grade * c, 0.0, 1.0);
#endif
          rgb += w * c;
          depth += w * t;
#ifdef NORMALS
          vec3 slope = densitySlope(texel, corner);
#ifdef CONTRACTED
          slope = pullBack(slope * halfGrid, MOVED_POINT) * scale;
#else
          slope *= scale;
#endif
#ifdef EDITED
          if (moved) slope = throughEdits(slope, eye + t * d);
#endif
          normal -= w * slope / max(length(slope), 1e-12);
#endif
        }
      }
    }
    t += h;
  }
  float opacity = 1.0 - T;
  outColor = eightBits(vec4(rgb + T * background, opacity));
#ifdef COUNT
  outDepth = uint(reads / 4) << 16 | uint(samples);
#else
  outDepth = floatBitsToUint(opacity > 1e-6 ? depth / opacity : intBitsToFloat(0x7f800000));
#endif
#ifdef NORMALS
  float size = length(normal);
  outNormal = eightBits(vec4(size > 1e-6 ? 0.5 + 0.5 * normal / size : vec3(0.5), opacity));
#endif
}
`;function Jt(r,e){const{source:t,colors:s}=jt(r.K),n=[`#define BRICK ${e}`,`#define COLORS ${s}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return r.contracted&&n.push("#define CONTRACTED"),r.edited&&n.push("#define EDITED"),r.edited&&r.graded&&n.push("#define GRADED"),r.edited&&r.bent&&n.push("#define BENT"),r.normals&&n.push("#define NORMALS"),r.count&&n.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...n,Yt,t,r.edited?Xt(r.edits):"",Kt].join(`
`)}function Zt(r,e,t,s,n,o){const{bounds:i,contracted:a}=t.field,{resolution:c,unit:l,steps:h}=t.header,{atlasBricks:u,edge:d,dims:f}=s,p=i[1].map((w,E)=>w-i[0][E]).map((w,E)=>a?2/w:(c[E]-1)/w),y=i[0].map((w,E)=>a?.5*(w+i[1][E]):w);r.uniform3f(e("atlasScale"),1/(u[0]*d),1/(u[1]*d),1/(u[2]*d)),r.uniform3i(e("indexDims"),...f),r.uniform3i(e("bricksOrigin"),...n.origin),r.uniform3i(e("bricksDims"),...n.dims),r.uniform3i(e("resolution"),...c),r.uniform3fv(e("lower"),y),r.uniform3fv(e("scale"),p),r.uniform3fv(e("halfGrid"),c.map(w=>(w-1)/4)),r.uniform1f(e("unit"),l),r.uniform1f(e("marchStep"),a?o:o/Math.max(...p)),r.uniform1fv(e("coefficientSteps"),h)}function Qt(r,e,t,{width:s,height:n}){const{c2w:o}=t,i=s/t.width,a=n/t.height;r.uniform3f(e("eye"),o[3],o[7],o[11]),r.uniformMatrix3fv(e("rotation"),!0,[o[0],o[1],o[2],o[4],o[5],o[6],o[8],o[9],o[10]]),r.uniform4f(e("lens"),t.fx*i,t.fy*a,t.cx*i,t.cy*a),r.uniform1f(e("height"),n)}function Oe([r,e],t){const s=.5*Math.hypot(...e.map((o,i)=>o-r[i])),n=Math.hypot(...e.map((o,i)=>.5*(o+r[i])-t.c2w[4*i+3]));return[Math.max(0,n-s),n+s]}class ${constructor(e,t,s,n){this.vertices=e,this.brick=t,this.low=s,this.dims=n;const o=t**3,{bricks:i,masks:a}=e;this.storedBricks=new Int32Array(i.length).fill(-1),this.slots=new Int32Array(a.length/(o/8)*o).fill(-1);let c=0;i.forEach((h,u)=>{h&&(this.storedBricks[u]=c++)});let l=0;for(let h=0;h<this.slots.length;h++)a[h>>3]>>(h&7)&1&&(this.slots[h]=l++)}slots;storedBricks;static fromLevel(e){const{brick:t}=e.field;return new $(e,t,[0,0,0],e.header.resolution.map(s=>Math.ceil(s/t)))}slot(e,t,s){const{brick:n,low:o,dims:i}=this,a=Math.floor(e/n)-o[0],c=Math.floor(t/n)-o[1],l=Math.floor(s/n)-o[2];if(a<0||c<0||l<0||a>=i[0]||c>=i[1]||l>=i[2])return-1;const h=this.storedBricks[(a*i[1]+c)*i[2]+l];return h<0?-1:this.slots[((h*n+e%n)*n+t%n)*n+s%n]}}class I extends Error{}function ne(r,e,t=0){const s=r.field.brick,n=s+1,o=r.header.resolution.map(p=>Math.ceil((p-1)/s)),i=es(r,o),a=Math.min(255,Math.floor(e/n)),c=i.length+t,l=Math.min(a,Math.max(1,Math.ceil(Math.cbrt(c)))),h=Math.min(a,Math.max(1,Math.ceil(Math.sqrt(c/l)))),u=Math.max(1,Math.ceil(c/(l*h)));if(u>a)throw new I(`${c} bricks do not fit into textures of ${e} texels an edge`);const d=new Uint8Array(4*o[0]*o[1]*o[2]),f=[l,h,u];for(const[p,y]of i.entries())d.set(oe(p,f),4*y);const m=Math.ceil(3*r.header.steps.length/4);return{brick:s,edge:n,dims:o,atlasBricks:f,count:i.length,index:d,bricks:i,colorTextures:m}}function oe(r,[e,t]){return[r%e,Math.floor(r/e)%t,Math.floor(r/(e*t)),255]}function ie({atlasBricks:r,edge:e,colorTextures:t,index:s}){return r[0]*r[1]*r[2]*e**3*(2+4*t)+s.length}function es(r,e){const{codes:t,dims:s}=r.occupancy,n=r.field.brick/4,o=new Uint8Array(e[0]*e[1]*e[2]);let i=0;for(let a=0;a<s[0];a++)for(let c=0;c<s[1];c++)for(let l=0;l<s[2];l++,i++)t[i]<256&&(o[(Math.floor(a/n)*e[1]+Math.floor(c/n))*e[2]+Math.floor(l/n)]=1);return Int32Array.from(o.keys()).filter(a=>o[a]===1)}class Me{constructor(e,t){this.layout=e,this.sources=t}texels(e,t,s){const{edge:n,colorTextures:o,brick:i,dims:a}=this.layout,c=t*s*n**3,l={density:new Uint16Array(c),colors:Array.from({length:o},()=>new Uint8Array(4*c).fill(128))},h=t*n,u=h*s*n;for(let d=0;d<e.length;d++){const f=e[d],m=[Math.floor(f/(a[1]*a[2])),Math.floor(f/a[2])%a[1],f%a[2]],p=d%t*n+Math.floor(d/t)*n*h;for(let y=0;y<n;y++)for(let w=0;w<n;w++)for(let E=0;E<n;E++)this.putTexel(l,p+y*u+w*h+E,m[0]*i+y,m[1]*i+w,m[2]*i+E)}return l}putTexel(e,t,s,n,o){for(const i of this.sources){const a=i.slot(s,n,o);if(a<0)continue;const{density:c,sh:l}=i.vertices,h=l.length/c.length;e.density[t]=c[a];for(let u=0;u<h;u++)e.colors[u>>2][4*t+(u&3)]=l[u*c.length+a];return}}}const Ue=1,ts=2;async function Ne(r,e,t){const s=[...await r.read(`${e}.box`)],n=await r.read(`${e}.cells`),o=await r.read(`${e}.bricks`),i=await r.read(`${e}.masks`);return{key:t,low:s.slice(0,3),dims:s.slice(3),cells:n,bricks:o,masks:i,...await Se(r,e)}}function De(r,{dims:e}){return Int32Array.from(ae(r,e,Ue))}function ss(r,e,t){const{dims:s,atlasBricks:n}=r,o=4*s[1]*s[2],i=Math.max(s[0],...e.map(c=>c.place+c.end)),a=new Uint8Array(i*o);a.set(r.index);for(const{layer:c,place:l,...h}of e){const u=l*o,[d,f]=[Math.max(0,h.first),Math.min(h.end,s[0])].map(y=>y*o);a.set(r.index.subarray(d,f),u+d);const m=t(c);let p=0;for(const y of ae(c,s,Ue))a.set(oe(m[p++],n),u+4*y);for(const y of ae(c,s,ts))a.fill(0,u+4*y,u+4*y+4)}return{dims:[i,s[1],s[2]],index:a}}function*ae({low:r,dims:e,cells:t},s,n){let o=0;for(let i=r[0];i<r[0]+e[0];i++)for(let a=r[1];a<r[1]+e[1];a++)for(let c=r[2];c<r[2]+e[2];c++,o++)t[o]===n&&(yield(i*s[1]+a)*s[2]+c)}async function Ce(r,e=null){const t=await C.open(new B(r),"cageedit",3),{header:s}=t,n=await t.read("rows"),o=[];for(const[f,{key:m}]of s.lattices.entries()){const p=[...o,...e?.lattices??[]].find(y=>y.key===m);o.push(p??{key:m,halves:se(await t.read(`lattice.${f}`))})}const i=[];for(const[f,{key:m,...p}]of s.layers.entries()){const y=[...i,...e?.layers??[]].find(({layer:w})=>w.key===m);i.push({layer:y?.layer??await Ne(t,`layer.${f}`,m),...p})}const{key:a,origin:c,dims:l,part:h}=s.occupancy,u=e?.occupancy??null;let d;if(u?.key===a)d=u;else{const f=await t.read("occupancy");if(h===null)d={key:a,origin:c,dims:l,codes:f,changed:null};else if(u?.key===h.of)d={key:a,origin:c,dims:l,codes:rs(u,h.low,h.dims,f),changed:{...h,codes:f}};else throw new Error("the edits are a difference to edits that this page does not have; reload it")}return{edits:s.edits,boxes:s.boxes,preserveOpacity:s.preserve_opacity,rows:n,lattices:o,layers:i,occupancy:d}}function rs({dims:r,codes:e},t,s,n){const o=e.slice();let i=0;for(let a=t[0];a<t[0]+s[0];a++)for(let c=t[1];c<t[1]+s[1];c++,i+=s[2])o.set(n.subarray(i,i+s[2]),(a*r[1]+c)*r[2]+t[2]);return o}const W=`#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;function z(r){for(const e of[r.BLEND,r.DEPTH_TEST,r.CULL_FACE,r.STENCIL_TEST,r.SCISSOR_TEST,r.DITHER])r.disable(e);r.colorMask(!0,!0,!0,!0),r.depthMask(!1)}function P(r){for(let e=15;e>=0;e--)r.activeTexture(r.TEXTURE0+e),r.bindTexture(r.TEXTURE_2D,null),r.bindTexture(r.TEXTURE_3D,null);r.bindVertexArray(null),r.bindFramebuffer(r.FRAMEBUFFER,null),r.useProgram(null)}const ns=1/4,os=64;function is(r,e,t,s){const n=te(r,r.MAX_3D_TEXTURE_SIZE),o=s(ne(e,n)),i=ne(e,n,o),a=ie(i);if(a>t)throw new I(`the field takes ${Math.ceil(a/2**20)} MiB of the GPU, more than the ${Math.floor(t/2**20)} allowed`);if(!e.last)return i;try{const c=ne(e,n,o+Math.max(os,Math.ceil(ns*(i.count+o))));return ie(c)>t?i:c}catch(c){if(c instanceof I)return i;throw c}}async function as(r,e,t,s){const n=ke(r,e,t);try{for(let o=n.next();;o=s()?n.next():n.throw(new Error("not wanted any more"))){if(o.done)return o.value;await new Promise(i=>setTimeout(i))}}catch(o){if(!s())return null;throw o}}function cs(r,e,t){const s=ke(r,e,t);for(;;){const n=s.next();if(n.done)return n.value}}function*ke(r,e,t){const{atlasBricks:s,edge:n,dims:o}=t,i=s.map(l=>l*n),a=[];let c=!1;try{const l=L(r,r.R16F,i,r.LINEAR);a.push(l);const h=Array.from({length:t.colorTextures},()=>{const m=L(r,r.RGBA8,i,r.LINEAR);return a.push(m),m}),u=new Me(t,[$.fromLevel(e)]),d=s[0]*s[1];for(let m=0;m<s[2];m++){N(r);const p=t.bricks.subarray(m*d,(m+1)*d);Fe(r,{layout:t,density:l,colors:h},u.texels(p,s[0],s[1]),[0,0,m],[s[0],s[1]]),yield}N(r);const f=L(r,r.RGBA8UI,[o[2],o[1],o[0]],r.NEAREST);return a.push(f),r.texSubImage3D(r.TEXTURE_3D,0,0,0,0,o[2],o[1],o[0],r.RGBA_INTEGER,r.UNSIGNED_BYTE,t.index),r.bindTexture(r.TEXTURE_3D,null),j(r),c=!0,{layout:t,density:l,colors:h,index:f,slices:o[0],bytes:ie(t)}}finally{if(!c)for(const l of a)r.deleteTexture(l)}}function Fe(r,{layout:{edge:e},density:t,colors:s},n,o,i){const a=(c,l,h,u)=>{r.bindTexture(r.TEXTURE_3D,c);const[d,f,m]=o.map(p=>p*e);r.texSubImage3D(r.TEXTURE_3D,0,d,f,m,i[0]*e,i[1]*e,e,l,h,u)};a(t,r.RED,r.HALF_FLOAT,n.density),n.colors.forEach((c,l)=>a(s[l],r.RGBA,r.UNSIGNED_BYTE,c)),r.bindTexture(r.TEXTURE_3D,null)}function Le(r,{dims:e,codes:t}){N(r);const s=L(r,r.R16UI,[e[2],e[1],e[0]],r.NEAREST);return r.texSubImage3D(r.TEXTURE_3D,0,0,0,0,e[2],e[1],e[0],r.RED_INTEGER,r.UNSIGNED_SHORT,t),r.bindTexture(r.TEXTURE_3D,null),s}function Be(r,e){for(const t of[e.density,e.index,...e.colors])r.deleteTexture(t)}class ls{free;allocated=new Map;constructor(e,t){this.free=Array.from({length:Math.max(0,t-e)},(s,n)=>t-1-n)}get left(){return this.free.length}get(e){return this.allocated.get(e)??null}retain(e){for(const[t,s]of this.allocated)e.has(t)||(this.free.push(...Array.from(s).reverse()),this.allocated.delete(t))}allocate(e,t){if(t>this.free.length)return null;const s=Int32Array.from({length:t},()=>this.free.pop()??-1);return this.allocated.set(e,s),s}}function hs(r,e){return[...new Map(r.map(({layer:s})=>[s.key,s])).values()].reduce((s,n)=>s+De(n,e).length,0)}class Ie{constructor(e,t,s){this.gl=e,this.textures=t,this.level=s;const{atlasBricks:n,count:o}=t.layout;this.allocator=new ls(o,n[0]*n[1]*n[2])}allocator;fieldVertices=null;shownKey="[]";set(e){const t=JSON.stringify(e.map(({layer:n,place:o,first:i,end:a})=>[n.key,o,i,a]));if(t===this.shownKey)return 0;this.allocator.retain(new Set(e.map(({layer:n})=>n.key)));let s=0;for(const{layer:n}of e){if(this.allocator.get(n.key))continue;const o=De(n,this.textures.layout),i=this.allocator.allocate(n.key,o.length);if(i===null)return this.shownKey="",null;s+=this.upload(n,o,i)}return s+=this.putIndex(e),this.shownKey=t,j(this.gl),s}upload(e,t,s){const{gl:n,textures:o,level:i}=this,{layout:a}=o;this.fieldVertices??=$.fromLevel(i);const c=new Me(a,[new $(e,a.brick,e.low,e.dims),this.fieldVertices]);return N(n),t.forEach((l,h)=>{const[u,d,f]=oe(s[h],a.atlasBricks);Fe(n,o,c.texels([l],1,1),[u,d,f],[1,1])}),t.length*a.edge**3*(2+4*a.colorTextures)}putIndex(e){const{gl:t,textures:s}=this,{dims:n,index:o}=ss(s.layout,e,i=>this.allocator.get(i.key)??[]);return N(t),n[0]!==s.slices&&(t.deleteTexture(s.index),s.index=L(t,t.RGBA8UI,[n[2],n[1],n[0]],t.NEAREST),s.slices=n[0]),t.bindTexture(t.TEXTURE_3D,s.index),t.texSubImage3D(t.TEXTURE_3D,0,0,0,0,n[2],n[1],n[0],t.RGBA_INTEGER,t.UNSIGNED_BYTE,o),t.bindTexture(t.TEXTURE_3D,null),o.length}}class ce{constructor(e,t,s,n){this.gl=e,this.memory=t,this.level=s,this.textures=n,this.layers=s.last?new Ie(e,n,s):null,this.occupancy=Le(e,s.occupancy)}occupancy;layers;solidOccupancy=null;static async upload(e,t,s,n,o){const i=await as(e,s,ze(e,t,s,n),o);return i&&new ce(e,t,s,i)}get layered(){return this.layers!==null}putLayers(e){if(this.layers===null)return 0;const t=this.layers.set(e);if(t!==null)return t;const{gl:s,level:n}=this,o=ze(s,this.memory,n,e);return Be(s,this.textures),this.textures=cs(s,n,o),this.layers=new Ie(s,this.textures,n),this.layers.set(e)??0}get fullOccupancy(){const{occupancy:e}=this.level;return this.solidOccupancy??=Le(this.gl,{...e,codes:new Uint16Array(e.codes.length).fill(255)}),this.solidOccupancy}dispose(){Be(this.gl,this.textures),this.gl.deleteTexture(this.occupancy),this.gl.deleteTexture(this.solidOccupancy)}}function ze(r,e,t,s){return is(r,t,e,n=>t.last?hs(s,n):0)}class Pe{constructor(e){this.gl=e}width=1;height=1;textures=null;framebuffer=null;get color(){return this.textures?.color??null}get normals(){return this.textures?.normals??null}get depth(){return this.textures?.depth??null}setSize(e,t){e===this.width&&t===this.height||(this.dispose(),this.width=e,this.height=t)}bind(e){const{gl:t}=this;if(this.textures&&e&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={color:this.texture(t.RGBA8,t.LINEAR),depth:this.texture(t.R32UI,t.NEAREST),normals:e?this.texture(t.RGBA8,t.NEAREST):null},this.framebuffer=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer);const{color:s,depth:n,normals:o}=this.textures;for(const[i,a]of[s,n,o].entries())a&&t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+i,t.TEXTURE_2D,a,0)}t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.drawBuffers([t.COLOR_ATTACHMENT0,t.COLOR_ATTACHMENT1,...e?[t.COLOR_ATTACHMENT2]:[]]),t.viewport(0,0,this.width,this.height)}read(e){const{gl:t,width:s,height:n}=this,o=new Uint8Array(4*s*n),i=e&&this.textures?.normals?new Uint8Array(4*s*n):null;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.pixelStorei(t.PACK_ALIGNMENT,1),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,s,n,t.RGBA,t.UNSIGNED_BYTE,o),i&&(t.readBuffer(t.COLOR_ATTACHMENT2),t.readPixels(0,0,s,n,t.RGBA,t.UNSIGNED_BYTE,i)),t.bindFramebuffer(t.FRAMEBUFFER,null);const a=le(this.readDepth(),s);return{width:s,height:n,rgba:le(o,4*s),depth:a,normals:i&&le(i,4*s)}}readBits(e,t){const{gl:s}=this,n=new Uint32Array(e*t);if(s.bindBuffer(s.PIXEL_PACK_BUFFER,null),s.pixelStorei(s.PACK_ALIGNMENT,1),s.getParameter(s.IMPLEMENTATION_COLOR_READ_FORMAT)===s.RED_INTEGER)s.readPixels(0,0,e,t,s.RED_INTEGER,s.UNSIGNED_INT,n);else{const o=new Uint32Array(4*e*t);s.readPixels(0,0,e,t,s.RGBA_INTEGER,s.UNSIGNED_INT,o);for(let i=0;i<n.length;i++)n[i]=o[4*i]}return new Float32Array(n.buffer)}wait(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.readBuffer(e.COLOR_ATTACHMENT0),e.readPixels(0,0,1,1,e.RGBA,e.UNSIGNED_BYTE,new Uint8Array(4)),e.bindFramebuffer(e.FRAMEBUFFER,null)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const s of Object.values(t))e.deleteTexture(s);e.deleteFramebuffer(this.framebuffer),this.forget()}readDepth(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.readBuffer(e.COLOR_ATTACHMENT1);const t=this.readBits(this.width,this.height);return e.bindFramebuffer(e.FRAMEBUFFER,null),t}texture(e,t){const{gl:s}=this,n=s.createTexture();return s.bindTexture(s.TEXTURE_2D,n),s.texStorage2D(s.TEXTURE_2D,1,e,this.width,this.height),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MIN_FILTER,t),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MAG_FILTER,t),s.bindTexture(s.TEXTURE_2D,null),n}}function le(r,e){const t=r.length/e;for(let s=0;s<t>>1;s++){const[n,o]=[s*e,(t-1-s)*e],i=r.slice(n,n+e);r.copyWithin(n,o,o+e),r.set(i,o)}return r}const J=["color","depth","opacity","normals"],us=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform sampler2D normals;
uniform vec2 size;
uniform vec2 reach;
uniform int view;
out vec4 color;
void main() {
  vec2 at = gl_FragCoord.xy / size;
  vec4 c = texture(picture, at);
  if (view == ${J.indexOf("depth")}) {
    float far = uintBitsToFloat(texelFetch(depthBits, ivec2(at * vec2(textureSize(depthBits, 0))), 0).r);
    float share = (min(far, reach.y) - reach.x) / max(reach.y - reach.x, 1e-9);
    c.rgb = vec3((1.0 - 0.85 * clamp(share, 0.0, 1.0)) * c.a);
  } else if (view == ${J.indexOf("opacity")}) {
    c.rgb = vec3(c.a);
  } else if (view == ${J.indexOf("normals")}) {
    c.rgb = texture(normals, at).rgb * c.a;
  }
  color = vec4(c.rgb, 1.0);
}`,ds=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform int stride;
uniform int height;
out uint bits;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) * stride;
  at.y = height - 1 - at.y;
  bits = texelFetch(picture, at, 0).a > 0.5 ? texelFetch(depthBits, at, 0).r : 0x7f800000u;
}`;class Xe{constructor(e,t){this.gl=e,this.targets=t}programs=null;distanceTarget=null;show(e,t,s,n){const{gl:o}=this,{program:i,uniform:a}=this.compiledPrograms.show;o.viewport(0,0,s,n),o.useProgram(i),this.bind(a),o.activeTexture(o.TEXTURE2),o.bindTexture(o.TEXTURE_2D,this.targets.normals),o.uniform1i(a("normals"),2),o.uniform2f(a("size"),s,n),o.uniform2f(a("reach"),...t),o.uniform1i(a("view"),J.indexOf(e)),o.drawArrays(o.TRIANGLES,0,3)}distances(e){const{gl:t,targets:s}=this,n=Math.max(1,Math.ceil(Math.sqrt(s.width*s.height/e))),[o,i]=[Math.ceil(s.width/n),Math.ceil(s.height/n)];this.bindDistanceTarget(o,i);const{program:a,uniform:c}=this.compiledPrograms.distances;return t.viewport(0,0,o,i),t.useProgram(a),this.bind(c),t.uniform1i(c("stride"),n),t.uniform1i(c("height"),s.height),t.drawArrays(t.TRIANGLES,0,3),t.readBuffer(t.COLOR_ATTACHMENT0),{width:o,height:i,values:s.readBits(o,i)}}forget(){this.programs=this.distanceTarget=null}dispose(){const{gl:e}=this;for(const{program:t}of Object.values(this.programs??{}))e.deleteProgram(t);e.deleteTexture(this.distanceTarget?.texture??null),e.deleteFramebuffer(this.distanceTarget?.framebuffer??null),this.forget()}get compiledPrograms(){return this.programs??={show:F(this.gl,W,us),distances:F(this.gl,W,ds)},this.programs}bind(e){const{gl:t,targets:s}=this;t.activeTexture(t.TEXTURE0),t.bindTexture(t.TEXTURE_2D,s.color),t.uniform1i(e("picture"),0),t.activeTexture(t.TEXTURE1),t.bindTexture(t.TEXTURE_2D,s.depth),t.uniform1i(e("depthBits"),1)}bindDistanceTarget(e,t){const{gl:s}=this;if(this.distanceTarget?.width!==e||this.distanceTarget.height!==t){s.deleteTexture(this.distanceTarget?.texture??null),s.deleteFramebuffer(this.distanceTarget?.framebuffer??null);const n=s.createTexture();s.bindTexture(s.TEXTURE_2D,n),s.texStorage2D(s.TEXTURE_2D,1,s.R32UI,e,t);const o=s.createFramebuffer();s.bindFramebuffer(s.FRAMEBUFFER,o),s.framebufferTexture2D(s.FRAMEBUFFER,s.COLOR_ATTACHMENT0,s.TEXTURE_2D,n,0),this.distanceTarget={texture:n,framebuffer:o,width:e,height:t}}s.bindFramebuffer(s.FRAMEBUFFER,this.distanceTarget.framebuffer),s.drawBuffers([s.COLOR_ATTACHMENT0])}}const fs=768*2**20;class Ge{constructor(e,t=fs){this.gl=e,this.memory=t,this.targets=new Pe(e),this.viewPasses=new Xe(e,this.targets),this.editTextures=new Gt(e),this.vertices=e.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;inBands=!0;inOrder=!0;editable=!0;onOrder=null;compileTime=0;compiled=0;shownField=null;editTextures;viewPasses;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shownField?.level??null}get uploaded(){return this.editTextures.uploaded}get activeEdits(){return this.edited?this.editTextures.edits:null}get bytes(){return this.shownField?.textures.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const s=++this.loading,n=()=>s===this.loading;let o=0;for await(const i of Vt(e,t.onArrival)){if(await this.take(i,n),!n())return;t.onLevel?.(++o,i.field.levels.length)}}async restore(){const{shownField:e}=this,{edits:t}=this.editTextures;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shownField=null;for(const n of[this.targets,this.viewPasses,this.editTextures])n.forget();const s=++this.loading;this.setEdits(t),e&&await this.take(e.level,()=>s===this.loading)}async readEdits(e,t){return await Ce(e,t)}async prepare(){}setEdits(e){this.editTextures.set(e),this.putLayers()}render(e={}){const{gl:t,shownField:s,camera:n,activeEdits:o}=this;if(!s||!n||t.isContextLost())return!1;const{level:i,textures:a}=s,{width:c,height:l}=this.targets,h={K:i.header.steps.length,contracted:i.field.contracted,edited:o!==null,edits:o&&It(o.edits),normals:e.normals??!1,graded:o!==null&&zt(o.rows,o.edits),bent:o!==null&&Pt(o.rows,o.edits),count:e.count??!1},{program:u,uniform:d}=this.program(h,i.field.brick);this.targets.bind(h.normals),t.useProgram(u),t.bindVertexArray(this.vertices),z(this.gl);const f=o&&i.last?o.occupancy:i.occupancy;Zt(t,d,i,a.layout,f,this.step??i.field.step),Qt(t,d,n,this.targets),t.uniform1f(d("near"),this.near),t.uniform3f(d("background"),...this.background);let m=0;const p=(g,x,T)=>{t.activeTexture(t.TEXTURE0+m),t.bindTexture(x,T),t.uniform1i(d(g),m++)};p("densityAtlas",t.TEXTURE_3D,a.density),p("brickIndex",t.TEXTURE_3D,a.index),p("bricks",t.TEXTURE_3D,o?i.last?this.editTextures.bricks:s.fullOccupancy:s.occupancy),a.colors.forEach((g,x)=>p(`colorAtlas${x}`,t.TEXTURE_3D,g)),o&&(p("lattice",t.TEXTURE_2D,this.editTextures.bind(u)),t.uniform1i(d("editCount"),o.edits),t.uniform1i(d("boxCount"),o.boxes),t.uniform1i(d("preserveOpacity"),Number(o.preserveOpacity)),t.uniform1i(d("layered"),Number(s.layered)));const{first:y,count:w}=e.rows??{first:0,count:l},E=e.columns??{first:0,count:c};return t.enable(t.SCISSOR_TEST),t.scissor(E.first,y,E.count,w),t.drawArrays(t.TRIANGLES,0,3),t.disable(t.SCISSOR_TEST),P(t),!0}show(e,t,s=null,n="color"){const{gl:o}=this;o.bindFramebuffer(o.FRAMEBUFFER,s),o.bindVertexArray(this.vertices),z(this.gl),this.viewPasses.show(n,this.reach,e,t),P(this.gl)}read(e=!1){return this.targets.read(e)}distances(e){this.gl.bindVertexArray(this.vertices),z(this.gl);const t=this.viewPasses.distances(e);return P(this.gl),t}wait(){this.targets.wait()}dispose(){this.loading++,this.drop();for(const e of[this.targets,this.viewPasses,this.editTextures])e.dispose();for(const{program:e}of this.programs.values())this.gl.deleteProgram(e);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(e,t){const s=await ce.upload(this.gl,this.memory,e,this.layers,t);s!==null&&(this.drop(),this.shownField=s,this.putLayers())}get layers(){return this.editTextures.edits?.layers??[]}putLayers(){try{this.shownField&&this.editTextures.countUpload(this.shownField.putLayers(this.layers))}catch(e){throw e instanceof be&&this.drop(),e}}drop(){this.shownField?.dispose(),this.shownField=null}get reach(){const{shownField:e,camera:t}=this;return!e||!t?[0,1]:Oe(e.level.field.bounds,t)}program(e,t){const s=JSON.stringify([e,t]);let n=this.programs.get(s);return n||(n=F(this.gl,W,Jt(e,t)),this.programs.set(s,n),this.compileTime=n.milliseconds,this.compiled+=1),n}}const $e='(function(){"use strict";class A{constructor(t,n=()=>{}){this.onArrival=n,this.source=(t instanceof ArrayBuffer?new Blob([t]).stream():t).getReader()}chunks=[];buffered=0;arrived=0;source;async take(t){for(;this.buffered<t;){const{value:s,done:c}=await this.source.read();if(c)throw new Error("the file of the field is truncated");this.chunks.push(s),this.buffered+=s.length,this.arrived+=s.length,this.onArrival(this.arrived)}const n=new Uint8Array(t);let e=0;for(;e<t;){const s=this.chunks[0],c=s.subarray(0,t-e);n.set(c,e),e+=c.length,c.length===s.length?this.chunks.shift():this.chunks[0]=s.subarray(c.length)}return this.buffered-=t,n}cancel(){this.source.cancel().catch(()=>{})}}async function b(o){const t=new Blob([o]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(t).arrayBuffer()}class d{constructor(t,n,e){this.header=t,this.entries=n,this.reader=e}next=0;static async open(t,n,e){const s=await t.take(16),c=new DataView(s.buffer);if(String.fromCharCode(...s.subarray(0,8))!==n)throw new Error(`not a file of the kind "${n}"`);const r=c.getUint32(8,!0);if(r!==e)throw new Error(`"${n}" of version ${r}, this page reads ${e}; reload it`);const a=new TextDecoder().decode(await t.take(c.getUint32(12,!0))),i=JSON.parse(a);return new d(i,i.arrays,t)}get left(){return this.entries.slice(this.next).reduce((t,n)=>t+n.bytes,0)}async read(t){const n=this.entries.at(this.next);if(n?.name!==t)throw new Error(`the file of the field has no array "${t}" here`);this.next++;const e=await b(await this.reader.take(n.bytes));switch(n.type){case"u1":return new Uint8Array(e);case"u2":return new Uint16Array(e);case"i4":return new Int32Array(e);case"f4":return new Float32Array(e)}}}function p(o,t,n){const e=o>>15|t>>15<<1,s=[o,t,n].map(h=>((h&32767)-16384)/(16383*Math.SQRT2)),c=Math.sqrt(Math.max(0,1-s[0]**2-s[1]**2-s[2]**2)),[r,a,i,f]=[...s.slice(0,e),c,...s.slice(e)];return[1-2*(i*i+f*f),2*(a*i-r*f),2*(a*f+r*i),2*(a*i+r*f),1-2*(a*a+f*f),2*(i*f-r*a),2*(a*f-r*i),2*(i*f+r*a),1-2*(a*a+i*i)]}function k(o,t,[n,e]){const s=o.length/3,c=new Float32Array(9*s);for(let r=0;r<s;r++){const a=p(o[r],o[s+r],o[2*s+r]);for(let i=0;i<3;i++){const f=Math.exp(n+(e-n)*t[i*s+r]/65535);for(let h=0;h<3;h++)c[9*r+3*h+i]=a[3*h+i]*f}}return c}function m(o){const t=new Float32Array(o.length/9*6);for(let n=0,e=0;n<o.length;n+=9)for(let s=0;s<3;s++)for(let c=s;c<3;c++){let r=0;for(let a=0;a<3;a++)r+=o[n+3*s+a]*o[n+3*c+a];t[e++]=r}return t}const v=256;function w(o){const t=o.length/2,n=new Uint16Array(t);for(let e=0;e<t;e++)n[e]=o[e]<<8|o[t+e];return n}function S(o,t,n){const e=t.length/(3*n),s=256**e-1,c=new Float32Array(3*n);for(let r=0;r<n;r++){const a=6*Math.floor(r/v);for(let i=0;i<3;i++){let f=0;for(let u=0;u<e;u++)f=256*f+t[(3*u+i)*n+r];const h=o[a+i];c[3*r+i]=h+(o[a+3+i]-h)*f/s}}return c}const U="cagesped",M=2,g=16;async function x(o){const t=await d.open(new A(o),U,M),{count:n,changed:e,packed:s,log_scales:c}=t.header,r=async y=>await t.read(y),a=async y=>await t.read(y),i=E(await r("hidden"),n),f=await t.read("sources"),h=s?S(await a("chunks"),await r("means"),e):await a("means"),u=s?m(k(w(await r("rotations")),w(await r("scales")),c)):await a("covariances"),l=w(await r("opacities")),B=w(await r("turns")),C=await t.read("gains");return{count:n,hidden:i,changed:e,means:h,records:R(f,h,u,l,B,C)}}function E(o,t){const n=new Uint8Array(t);for(let e=0;e<t;e++)n[e]=o[e>>3]>>(e&7)&1;return n}function R(o,t,n,e,s,c){const r=o.length,a=new Uint32Array(g*r),[i,f]=[new Uint32Array(t.buffer),new Uint32Array(n.buffer)];for(let h=0;h<r;h++){const u=g*h;for(let l=0;l<3;l++)a[u+l]=i[3*h+l];a[u+3]=o[h];for(let l=0;l<6;l++)a[u+4+l]=f[6*h+l];a[u+10]=s[h]|s[r+h]<<16,a[u+11]=s[2*r+h]|e[h]<<16;for(let l=0;r*l<c.length;l++)a[u+12+l]=c[r*l+h]}return a}self.onmessage=async({data:o})=>{const{file:t,answer:n}=o;try{const e=await x(t);n.postMessage({edits:e},[e.hidden.buffer,e.means.buffer,e.records.buffer])}catch(e){n.postMessage({why:e instanceof Error?e.message:String(e)})}},self.postMessage("ready")})();\n',We=typeof self<"u"&&self.Blob&&new Blob([$e],{type:"text/javascript;charset=utf-8"});function ps(r){let e;try{if(e=We&&(self.URL||self.webkitURL).createObjectURL(We),!e)throw"";const t=new Worker(e,{name:r?.name});return t.addEventListener("error",()=>{(self.URL||self.webkitURL).revokeObjectURL(e)}),t}catch{return new Worker("data:text/javascript;charset=utf-8,"+encodeURIComponent($e),{name:r?.name})}finally{e&&(self.URL||self.webkitURL).revokeObjectURL(e)}}function He(r,e,t){const s=r>>15|e>>15<<1,n=[r,e,t].map(h=>((h&32767)-16384)/(16383*Math.SQRT2)),o=Math.sqrt(Math.max(0,1-n[0]**2-n[1]**2-n[2]**2)),[i,a,c,l]=[...n.slice(0,s),o,...n.slice(s)];return[1-2*(c*c+l*l),2*(a*c-i*l),2*(a*l+i*c),2*(a*c+i*l),1-2*(a*a+l*l),2*(c*l-i*a),2*(a*l-i*c),2*(c*l+i*a),1-2*(a*a+c*c)]}function Ve(r,e,[t,s]){const n=r.length/3,o=new Float32Array(9*n);for(let i=0;i<n;i++){const a=He(r[i],r[n+i],r[2*n+i]);for(let c=0;c<3;c++){const l=Math.exp(t+(s-t)*e[c*n+i]/65535);for(let h=0;h<3;h++)o[9*i+3*h+c]=a[3*h+c]*l}}return o}function qe(r){const e=new Float32Array(r.length/9*6);for(let t=0,s=0;t<r.length;t+=9)for(let n=0;n<3;n++)for(let o=n;o<3;o++){let i=0;for(let a=0;a<3;a++)i+=r[t+3*n+a]*r[t+3*o+a];e[s++]=i}return e}const je="cagespla",ms=1,ys=256,S=8;function X(r){return 4*Math.ceil(3*((r+1)**2-1)/16)}async function*Ye(r,e,t){const s=new B(r,t);try{const n=await C.open(s,je,ms),{header:o}=n;e(o);let i=0;for(const[a,c]of o.levels.entries()){const l=c-i,h=async g=>await n.read(`${a}.${g}`),u=await n.read(`${a}.chunks`),d=Ke(u,await h("means"),l),f=await h("rotations"),m=await h("scales"),p=await h("opacities"),y=await h("colors"),w=xs(d,O(f),O(m),O(p),O(y)),E=ws(await h("sh"),l,o.degree);yield{header:o,first:i,count:l,last:a===o.levels.length-1&&!o.nodes,means:d,records:w,harmonics:E},i=c}}finally{s.cancel()}}function O(r){const e=r.length/2,t=new Uint16Array(e);for(let s=0;s<e;s++)t[s]=r[s]<<8|r[e+s];return t}function Ke(r,e,t){const s=e.length/(3*t),n=256**s-1,o=new Float32Array(3*t);for(let i=0;i<t;i++){const a=6*Math.floor(i/ys);for(let c=0;c<3;c++){let l=0;for(let u=0;u<s;u++)l=256*l+e[(3*u+c)*t+i];const h=r[a+c];o[3*i+c]=h+(r[a+3+c]-h)*l/n}}return o}function xs(r,e,t,s,n){const o=s.length,i=new Uint32Array(r.buffer),a=new Uint32Array(S*o);for(let c=0;c<o;c++){const l=S*c;a[l]=i[3*c],a[l+1]=i[3*c+1],a[l+2]=i[3*c+2],a[l+3]=n[c]|n[o+c]<<16,a[l+4]=e[c]|e[o+c]<<16,a[l+5]=e[2*o+c]|s[c]<<16,a[l+6]=t[c]|t[o+c]<<16,a[l+7]=t[2*o+c]|n[2*o+c]<<16}return a}function ws(r,e,t){const s=4*X(t),n=new Uint8Array(s*e),o=3*((t+1)**2-1);for(let i=0;i<o;i++)for(let a=0;a<e;a++)n[s*a+i]=r[e*i+a];return new Uint32Array(n.buffer)}const gs="cagesped",Es=2,Z=16;async function Je(r){const e=await C.open(new B(r),gs,Es),{count:t,changed:s,packed:n,log_scales:o}=e.header,i=async p=>await e.read(p),a=async p=>await e.read(p),c=Ze(await i("hidden"),t),l=await e.read("sources"),h=n?Ke(await a("chunks"),await i("means"),s):await a("means"),u=n?qe(Ve(O(await i("rotations")),O(await i("scales")),o)):await a("covariances"),d=O(await i("opacities")),f=O(await i("turns")),m=await e.read("gains");return{count:t,hidden:c,changed:s,means:h,records:Qe(l,h,u,d,f,m)}}function Ze(r,e){const t=new Uint8Array(e);for(let s=0;s<e;s++)t[s]=r[s>>3]>>(s&7)&1;return t}function Qe(r,e,t,s,n,o){const i=r.length,a=new Uint32Array(Z*i),[c,l]=[new Uint32Array(e.buffer),new Uint32Array(t.buffer)];for(let h=0;h<i;h++){const u=Z*h;for(let d=0;d<3;d++)a[u+d]=c[3*h+d];a[u+3]=r[h];for(let d=0;d<6;d++)a[u+4+d]=l[6*h+d];a[u+10]=n[h]|n[i+h]<<16,a[u+11]=n[2*i+h]|s[h]<<16;for(let d=0;i*d<o.length;d++)a[u+12+d]=o[i*d+h]}return a}const vs=1<<20;let Ts=null;async function et(r){const e=r.byteLength>vs?await(Ts??=Rs()):null;if(e===null)return await Je(r);const{port1:t,port2:s}=new MessageChannel,n=new Promise(i=>{t.onmessage=({data:a})=>i(a)});e.postMessage({file:r,answer:s},[r,s]);const o=await n;if(t.close(),"why"in o)throw new Error(o.why);return o.edits}function Rs(){return new Promise(r=>{const e=new ps;e.onmessage=()=>r(e),e.onerror=()=>r(null)})}function tt(r){const e=r.getExtension("EXT_color_buffer_float");return e&&r.getExtension("EXT_float_blend")?{color:r.RGBA16F,distance:r.R32F,isByte:!1}:e??r.getExtension("EXT_color_buffer_half_float")?{color:r.RGBA16F,distance:r.RGBA16F,isByte:!1}:{color:r.RGBA8,distance:r.RGBA8,isByte:!0}}class bs{constructor(e,t){this.gl=e,this.formats=t}textures=null;framebuffer=null;width=0;height=0;begin(e,t,s){const{gl:n,formats:o}=this;if(this.textures&&(e!==this.width||t!==this.height||s&&!this.textures.normal)&&this.dispose(),!this.textures){this.width=e,this.height=t,this.textures={color:this.texture(o.color),distance:this.texture(o.distance),normal:s?this.texture(o.color):null},this.framebuffer=n.createFramebuffer(),n.bindFramebuffer(n.FRAMEBUFFER,this.framebuffer);const{color:i,distance:a,normal:c}=this.textures;for(const[l,h]of[i,a,c].entries())h&&n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+l,n.TEXTURE_2D,h,0)}n.bindFramebuffer(n.FRAMEBUFFER,this.framebuffer),n.drawBuffers([n.COLOR_ATTACHMENT0,n.COLOR_ATTACHMENT1,...s?[n.COLOR_ATTACHMENT2]:[]]),n.viewport(0,0,e,t);for(let i=0;i<(s?3:2);i++)n.clearBufferfv(n.COLOR,i,[0,0,0,0])}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const s of Object.values(t))e.deleteTexture(s);e.deleteFramebuffer(this.framebuffer),this.forget()}texture(e){const{gl:t}=this,s=t.createTexture();return t.bindTexture(t.TEXTURE_2D,s),t.texStorage2D(t.TEXTURE_2D,1,e,this.width,this.height),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.NEAREST),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),s}}const he=65536;function As(r,e){const{means:t,hidden:s,changed:n}=r,[o,i,a]=e.axis,{offset:c,near:l}=e,h=t.length/3,u=h+(n?n.length/3:0),d=new Float32Array(u),f=new Uint32Array(d.buffer),m=new Uint32Array(u);let p=0;for(let x=0;x<h;x++){if(s!==null&&s[x]===1)continue;const T=o*t[3*x]+i*t[3*x+1]+a*t[3*x+2]+c;T<l||(d[p]=T,m[p++]=x)}if(n!==null)for(let x=h;x<u;x++){const T=3*(x-h),Ft=o*n[T]+i*n[T+1]+a*n[T+2]+c;Ft>=l&&(d[p]=Ft,m[p++]=x)}const y=new Uint32Array(he),w=new Uint32Array(p),E=new Uint32Array(p);for(let x=0;x<p;x++)y[f[x]&65535]++;let g=0;for(let x=he-1;x>=0;x--){const T=y[x];y[x]=g,g+=T}for(let x=p-1;x>=0;x--)w[y[f[x]&65535]++]=x;y.fill(0);for(let x=0;x<p;x++)y[f[x]>>>16]++;g=0;for(let x=he-1;x>=0;x--){const T=y[x];y[x]=g,g+=T}for(let x=0;x<p;x++){const T=w[x];E[y[f[T]>>>16]++]=m[T]}return E}const st=`(function(){"use strict";function R(s,l){const{means:f,hidden:w,changed:r}=s,[y,g,m]=l.axis,{offset:b,near:p}=l,i=f.length/3,A=i+(r?r.length/3:0),h=new Float32Array(A),a=new Uint32Array(h.buffer),d=new Uint32Array(A);let t=0;for(let n=0;n<i;n++){if(w!==null&&w[n]===1)continue;const e=y*f[3*n]+g*f[3*n+1]+m*f[3*n+2]+b;e<p||(h[t]=e,d[t++]=n)}if(r!==null)for(let n=i;n<A;n++){const e=3*(n-i),I=y*r[e]+g*r[e+1]+m*r[e+2]+b;I>=p&&(h[t]=I,d[t++]=n)}const o=new Uint32Array(65536),U=new Uint32Array(t),D=new Uint32Array(t);for(let n=0;n<t;n++)o[a[n]&65535]++;let c=0;for(let n=65535;n>=0;n--){const e=o[n];o[n]=c,c+=e}for(let n=t-1;n>=0;n--)U[o[a[n]&65535]++]=n;o.fill(0);for(let n=0;n<t;n++)o[a[n]>>>16]++;c=0;for(let n=65535;n>=0;n--){const e=o[n];o[n]=c,c+=e}for(let n=0;n<t;n++){const e=U[n];D[o[a[e]>>>16]++]=d[e]}return D}let u={means:new Float32Array(0),hidden:null,changed:null};self.onmessage=({data:s})=>{if(!("sort"in s)){u={...u,...s};return}const l=R(u,s.sort);self.postMessage(l,{transfer:[l.buffer]})}})();
`,rt=typeof self<"u"&&self.Blob&&new Blob([st],{type:"text/javascript;charset=utf-8"});function _s(r){let e;try{if(e=rt&&(self.URL||self.webkitURL).createObjectURL(rt),!e)throw"";const t=new Worker(e,{name:r?.name});return t.addEventListener("error",()=>{(self.URL||self.webkitURL).revokeObjectURL(e)}),t}catch{return new Worker("data:text/javascript;charset=utf-8,"+encodeURIComponent(st),{name:r?.name})}finally{e&&(self.URL||self.webkitURL).revokeObjectURL(e)}}const Ss=32768;class nt{onOrder=null;sortedHere=0;order=null;firstOrder=null;worker=null;hasNoWorker=!1;postedSet=null;running=null;preparing=null;next=null;outdated=!1;orderFor(e,t,s){this.firstOrder?.set===e&&(this.order=this.firstOrder,this.firstOrder=null);const{order:n}=this,o=n?.set===e?n:null;if(o!==null&&ue(o.depths,t))return o;if(o===null||s||this.isQuick(e))return this.next=null,this.outdated=this.running!==null,this.sortedHere+=1,this.order={numbers:As(e,t),set:e,depths:t};const{running:i}=this,a=i?.set===e&&ue(i.depths,t);return this.next=a?null:{set:e,depths:t,prepared:null},this.postNext(),o}prepare(e,t){return this.isQuick(e)?Promise.resolve():new Promise(s=>{this.preparing?.prepared?.(),this.preparing={set:e,depths:t,prepared:s},this.postNext()})}dispose(){this.worker?.terminate();const e=[this.running,this.preparing];this.worker=this.postedSet=this.running=this.preparing=this.next=this.firstOrder=this.order=null;for(const t of e)t?.prepared?.()}isQuick({means:e,changed:t}){return this.hasNoWorker||e.length+(t?.length??0)<=3*Ss}postNext(){const e=this.preparing??this.next;if(this.running!==null||e===null)return;e===this.preparing?this.preparing=null:this.next=null,this.running=e,this.worker??=this.startWorker();const{set:t,depths:s}=e,n=o=>this.worker?.postMessage(o);this.postedSet?.means!==t.means&&n({means:t.means}),this.postedSet!==t&&n({hidden:t.hidden,changed:t.changed}),this.postedSet=t,n({sort:s})}startWorker(){const e=new _s;return e.onmessage=({data:t})=>this.takeAnswer(t),e.onerror=()=>{this.hasNoWorker=!0,this.dispose(),this.onOrder?.()},e}takeAnswer(e){const{running:t,outdated:s}=this;if(this.running=null,this.outdated=!1,t===null)return;const n={numbers:e,set:t.set,depths:t.depths};t.prepared!==null?(this.firstOrder=n,t.prepared()):this.order?.set===t.set&&!s&&(this.order=n,this.onOrder?.()),this.postNext()}}function ue(r,e){return r.offset===e.offset&&r.near===e.near&&r.axis.every((t,s)=>t===e.axis[s])}function de({center:r},{c2w:e}){return[e[3]-r[0],e[7]-r[1],e[11]-r[2]]}function ot(r,e){return Math.max(e,r.near)}function fe(r,e,t){const{c2w:s}=e,[n,o,i]=de(r,e),a=[-s[2],-s[6],-s[10]];return{axis:a,offset:-(a[0]*n+a[1]*o+a[2]*i),near:ot(r,t)}}function Os(r,e){const[t,s]=r.bounds;return Math.hypot(...de(r,e))+Math.hypot(...s.map((n,o)=>n-t[o]))}const Ms=.02;function Us({bounds:[r,e]},t){const{c2w:s}=t,n=r.map((u,d)=>.5*(e[d]-u)),o=r.map((u,d)=>u+n[d]-s[4*d+3]),i=Math.hypot(...n),a=Math.max(Math.hypot(...o)-i,.1*i,1e-9),c=u=>o.reduce((d,f,m)=>d+f*s[4*m+u],0),l=-c(2),h=l>-i&&Math.abs(c(0))-i<=Math.max(l,i)*.5*t.width/t.fx&&Math.abs(c(1))-i<=Math.max(l,i)*.5*t.height/t.fy;return i/a*(h?1:Ms)}function it(r,e){if(e===null)return r.shift();let t=0;const s=r.map(n=>Us(n,e));return s.forEach((n,o)=>{n>s[t]&&(t=o)}),r.splice(t,1)[0]}const v=2048,pe=3,Ns=`
uniform usampler2D order;       // numbers of splats, from far to near
uniform uint count;             // numbers in the order
uniform usampler2D records, harmonics, changed;
uniform uint own;               // splats of the field; higher numbers are changed splats
uniform vec3 eye;               // relative to the field's center
uniform mat3 W;                 // rows: x right, y down, z forward
uniform vec2 focal, center, size;
uniform vec4 limits;            // of (x, y) / z: low, high of x, of y
uniform float near, logLow, logStep, colorStep;

// Mean in pixels, x right and y down; A, k of the conic A (x + k y)^2 + D y^2.
layout(location = 0) out uvec4 place;
// D, opacity (0: not shown), distance, its slope along x.
layout(location = 1) out uvec4 shape;
// Color, slope of the distance along y.
layout(location = 2) out uvec4 tint;

${ee(Ae)}

uvec4 texel(usampler2D from, uint n) { return texelFetch(from, ivec2(n % ${v}u, n / ${v}u), 0); }

// The quaternion (w, x, y, z as its y, z, w, x: xyz and w) of three numbers of 15 bits; see page_splats.encode_rotations.
vec4 rotation(uvec2 words) {
  uvec3 codes = uvec3(words.x & 65535u, words.x >> 16, words.y & 65535u);
  uint left = (codes.x >> 15) | (codes.y >> 15) << 1;
  vec3 c = (vec3(codes & 32767u) - 16384.0) / (16383.0 * sqrt(2.0));
  float most = sqrt(max(0.0, 1.0 - dot(c, c)));
  if (left == 0u) return vec4(c, most);
  if (left == 1u) return vec4(most, c.y, c.z, c.x);
  if (left == 2u) return vec4(c.y, most, c.z, c.x);
  return vec4(c.y, c.z, most, c.x);
}

vec3 rotated(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

// The matrix of a changed splat's color: its gains, or a grade; see page_splat_edits.encode_gains and encode_colors.
mat3 colorMatrix(uvec4 words) {
  uint kind = words.x >> 30;
  if (kind == 0u) {
    vec3 gain = exp2((vec3(words.x & 1023u, words.x >> 10 & 1023u, words.x >> 20) - 512.0) / 128.0);
    return mat3(gain.x, 0.0, 0.0, 0.0, gain.y, 0.0, 0.0, 0.0, gain.z);
  }
  uvec4 even = words & 16383u, odd = words >> 14 & 16383u;
  uint last = (words.x >> 28 & 3u) << 12 | (words.w >> 28) << 8 | (words.z >> 28) << 4 | words.y >> 28;
  mat3 codes = mat3(even.x, odd.y, even.w, odd.x, even.z, odd.w, even.y, odd.z, last);
  float range = kind == 1u ? 2.0 : kind == 2u ? 8.0 : 32.0;
  return range / 8191.0 * (codes - mat3(8192, 8192, 8192, 8192, 8192, 8192, 8192, 8192, 8192));
}

mat3 cholesky(float xx, float xy, float xz, float yy, float yz, float zz) {
  float a = sqrt(max(xx, 1e-38));
  float b = xy / a, c = xz / a;
  float d = sqrt(max(yy - b * b, 0.0));
  float e = d > 1e-6 * a ? (yz - b * c) / d : 0.0;
  float f = sqrt(max(zz - c * c - e * e, 0.0));
  return mat3(a, b, c, 0.0, d, e, 0.0, 0.0, f);
}
`,Ds=`
void main() {
  place = shape = tint = uvec4(0u);
#ifdef NORMALS
  normal = uvec4(0u);
#endif
  ivec2 here = ivec2(gl_FragCoord.xy);
  if (uint(here.y * ${v} + here.x) >= count) return;
  uint splat = texelFetch(order, here, 0).r;
  uint source = splat;
  vec3 mean;
  mat3 F;
  float o;
  vec4 turn = vec4(0.0, 0.0, 0.0, 1.0);
  float side = 1.0;             // -1 where the turn is that of a reflection, turned over
  mat3 grade = mat3(1.0);
  if (splat < own) {
    uvec4 first = texel(records, 2u * splat), second = texel(records, 2u * splat + 1u);
    mean = uintBitsToFloat(first.xyz);
    o = float(second.y >> 16) / 65535.0;
    vec3 s = exp(logLow + logStep * vec3(second.z & 65535u, second.z >> 16, second.w & 65535u));
    vec4 q = rotation(second.xy);
    F = mat3(s.x * rotated(q, vec3(1, 0, 0)), s.y * rotated(q, vec3(0, 1, 0)), s.z * rotated(q, vec3(0, 0, 1)));
  } else {
    uint n = 4u * (splat - own);
    uvec4 first = texel(changed, n), second = texel(changed, n + 1u), third = texel(changed, n + 2u);
    mean = uintBitsToFloat(first.xyz);
    source = first.w;
    vec4 C = uintBitsToFloat(second);
    F = cholesky(C.x, C.y, C.z, C.w, uintBitsToFloat(third.x), uintBitsToFloat(third.y));
    turn = rotation(third.zw);
    side = (third.w & 32768u) == 0u ? 1.0 : -1.0;
    o = float(third.w >> 16) / 65535.0;
    grade = colorMatrix(texel(changed, n + 3u));
  }
  vec3 offset = mean - eye;
  vec3 p = W * offset;
  if (p.z < near || o <= ALPHA_MIN) return;
  vec2 n = clamp(p.xy / p.z, limits.xz, limits.yw);
  vec3 rowX = vec3(W[0].x, W[1].x, W[2].x), rowY = vec3(W[0].y, W[1].y, W[2].y), rowZ = vec3(W[0].z, W[1].z, W[2].z);
  vec3 N0 = (focal.x / p.z * (rowX - n.x * rowZ)) * F;
  vec3 N1 = (focal.y / p.z * (rowY - n.y * rowZ)) * F;
  float a = dot(N0, N0), b = dot(N0, N1), c = dot(N1, N1);
  vec3 area = cross(N0, N1);
  float sharp = dot(area, area);
  float det = sharp + BLUR * (a + c + BLUR);
  float slopeDet = sharp + SLOPE_BLUR * (a + c + SLOPE_BLUR);
#ifdef ANTIALIASED
  o *= max(LEAST_COMPENSATION, sqrt(sharp / det));
#endif
  float reach = 2.0 * log(o / ALPHA_MIN);
  if (!(reach > 0.0)) return;
  vec2 at = p.xy / p.z * focal + center;
  vec2 extent = sqrt(reach * (vec2(a, c) + BLUR));
  if (any(lessThanEqual(at + extent, vec2(0.0))) || any(greaterThanEqual(at - extent, size))) return;
  place = floatBitsToUint(vec4(at, (c + BLUR) / det, -b / (c + BLUR)));
  float distance = length(offset);
  vec3 d = offset / distance;
  vec3 along = d * F;
  float alongU = dot(along, N0), alongV = dot(along, N1);
  vec2 slope = vec2(alongU * (c + SLOPE_BLUR) - alongV * b, alongV * (a + SLOPE_BLUR) - alongU * b) / slopeDet;
  shape = floatBitsToUint(vec4(1.0 / (c + BLUR), o, distance, slope.x));
#ifdef NORMALS
  vec3 axis = flattest(F);
  normal = floatBitsToUint(vec4(dot(axis, d) > 0.0 ? -axis : axis, 0.0));
#endif
  d = side * rotated(vec4(-turn.xyz, turn.w), d);
  tint = floatBitsToUint(vec4(max(grade * colorOf(source, d), 0.0), slope.y));
}
`,Cs=`
layout(location = 3) out uvec4 normal;
vec3 flattest(mat3 F) {
  mat3 C = F * transpose(F);
  mat3 B = mat3(cross(C[1], C[2]), cross(C[2], C[0]), cross(C[0], C[1]));
  for (int n = 0; n < 8; n++) {
    B /= max(B[0][0] + B[1][1] + B[2][2], 1e-37);
    B = B * B;
  }
  vec3 length2 = vec3(dot(B[0], B[0]), dot(B[1], B[1]), dot(B[2], B[2]));
  vec3 axis = length2.x >= length2.y && length2.x >= length2.z ? B[0] : length2.y >= length2.z ? B[1] : B[2];
  return axis / max(length(axis), 1e-37);
}
`;function ks(r){const e=X(r)/4,t=(r+1)**2,s=[...r>0?[`uniform float steps[${t-1}];`]:[],"vec3 colorOf(uint splat, vec3 d) {","  uvec2 last = texel(records, 2u * splat + 1u).zw;","  uint both = texel(records, 2u * splat).w;",`  vec3 rgb = 0.5 + ${re[0]} * colorStep * (vec3(both & 65535u, both >> 16, last.y >> 16) - 32768.0);`,...Array.from({length:e},(n,o)=>`  uvec4 t${o} = texel(harmonics, ${e}u * splat + ${o}u);`)];for(let n=1;n<t;n++){const o=[0,1,2].map(i=>{const a=3*(n-1)+i;return`(t${a>>4}.${"xyzw"[a>>2&3]} >> ${8*(a&3)} & 255u)`});s.push(`  rgb += (steps[${n-1}] * (${re[n]})) * (vec3(${o.join(", ")}) - 128.0);`)}return[...s,"  return rgb;","}"].join(`
`)}function Fs(r){return["#version 300 es","precision highp float;","precision highp int;","precision highp usampler2D;",...r.antialiased?["#define ANTIALIASED"]:[],...r.normals?["#define NORMALS"]:[],Ns,r.normals?Cs:"",ks(r.degree),Ds].join(`
`)}const at=ee(Ae),Ls=`#version 300 es
${at}
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D places, shapes, tints;
uniform vec2 size;
flat out vec4 where;
flat out vec4 how;
flat out vec4 color;
#ifdef NORMALS
uniform usampler2D normals;
flat out vec3 axis;
#endif
void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  int splat = gl_VertexID / 6, side = gl_VertexID - 6 * splat;
  ivec2 here = ivec2(splat % ${v}, splat / ${v});
  how = uintBitsToFloat(texelFetch(shapes, here, 0));
  if (how.y <= 0.0) return;
  where = uintBitsToFloat(texelFetch(places, here, 0));
  color = uintBitsToFloat(texelFetch(tints, here, 0));
#ifdef NORMALS
  axis = uintBitsToFloat(texelFetch(normals, here, 0)).xyz;
#endif
  float reach = 2.0 * log(how.y / ALPHA_MIN);
  // Two triangles: corners 0 1 2 and 3 2 1.
  int number = side < 3 ? side : 6 - side;
  vec2 corner = vec2(float(number & 1), float(number >> 1)) * 2.0 - 1.0;
  vec2 at = corner * (sqrt(reach / vec2(where.z, how.x)) + 0.01);
  at = where.xy + vec2(at.x - where.w * at.y, at.y);
  gl_Position = vec4(2.0 * at.x / size.x - 1.0, 1.0 - 2.0 * at.y / size.y, 0.0, 1.0);
}`,Bs=`#version 300 es
${at}
precision highp float;
flat in vec4 where;
flat in vec4 how;
flat in vec4 color;
uniform vec2 size;
uniform float unit;                 // of distances
layout(location = 0) out vec4 outColor;
layout(location = 1) out vec4 outDepth;
#ifdef NORMALS
flat in vec3 axis;
layout(location = 2) out vec4 outNormal;
#endif
void main() {
  vec2 d = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) - where.xy;
  float l = d.x + where.w * d.y;
  float q = where.z * l * l + how.x * d.y * d.y;
  float a = min(how.y * exp(-0.5 * q), ALPHA_MAX);
  if (a < ALPHA_MIN) discard;
  outColor = vec4(a * color.rgb, a);
  outDepth = vec4(a * unit * (how.z + how.w * d.x + color.w * d.y), 0.0, 0.0, a);
#ifdef NORMALS
  outNormal = vec4(a * (0.5 + 0.5 * axis), a);
#endif
}`,Is=`#version 300 es
precision highp float;
precision highp int;
uniform sampler2D gathered, distances;
uniform vec3 background;
uniform float unit;
layout(location = 0) out vec4 outColor;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
uniform sampler2D axes;
layout(location = 2) out vec4 outNormal;
#endif
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(gathered, at, 0);
  outColor = eightBits(vec4(sum.rgb + (1.0 - sum.a) * background, sum.a));
  float distance = texelFetch(distances, at, 0).r / unit;
  outDepth = floatBitsToUint(sum.a > 1e-6 ? distance / sum.a : intBitsToFloat(0x7f800000));
#ifdef NORMALS
  vec4 both = texelFetch(axes, at, 0);
  vec3 normal = 2.0 * both.rgb - both.a;
  float length_ = length(normal);
  outNormal = eightBits(vec4(length_ > 1e-3 ? 0.5 + 0.5 * normal / length_ : vec3(0.5), sum.a));
#endif
}`;function me(r,e){const t=r.indexOf(`
`)+1;return r.slice(0,t)+e.map(s=>`#define ${s}
`).join("")+r.slice(t)}class zs{constructor(e){this.gl=e}order=null;outputs=[];framebuffer=null;rows=0;reserve(e,t){const{gl:s}=this,n=Math.ceil(e/v),o=pe+(t?1:0);if(n<=this.rows&&o<=this.outputs.length)return!1;const i=Math.max(o,this.outputs.length);this.rows=Math.max(n,this.rows),this.drop(),this.order=this.texture(s.R32UI),this.outputs=Array.from({length:i},()=>this.texture(s.RGBA32UI)),this.framebuffer=s.createFramebuffer(),s.bindFramebuffer(s.FRAMEBUFFER,this.framebuffer);for(const[a,c]of this.outputs.entries())s.framebufferTexture2D(s.FRAMEBUFFER,s.COLOR_ATTACHMENT0+a,s.TEXTURE_2D,c,0);return!0}put(e){const{gl:t}=this,s=Math.floor(e.length/v),n=e.length-s*v;N(t),t.bindTexture(t.TEXTURE_2D,this.order),t.texSubImage2D(t.TEXTURE_2D,0,0,0,v,s,t.RED_INTEGER,t.UNSIGNED_INT,e),n>0&&t.texSubImage2D(t.TEXTURE_2D,0,0,s,n,1,t.RED_INTEGER,t.UNSIGNED_INT,e,s*v),t.bindTexture(t.TEXTURE_2D,null)}bind(e,t){const{gl:s}=this;s.bindFramebuffer(s.FRAMEBUFFER,this.framebuffer),s.drawBuffers(this.outputs.map((n,o)=>o<pe||t?s.COLOR_ATTACHMENT0+o:s.NONE)),s.viewport(0,0,v,Math.ceil(e/v))}dispose(){this.drop(),this.rows=0}drop(){const{gl:e}=this;for(const t of[this.order,...this.outputs])e.deleteTexture(t);e.deleteFramebuffer(this.framebuffer),this.order=this.framebuffer=null,this.outputs=[]}texture(e){const{gl:t}=this,s=t.createTexture();return t.bindTexture(t.TEXTURE_2D,s),t.texStorage2D(t.TEXTURE_2D,1,e,v,this.rows),Y(t,t.TEXTURE_2D,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),s}}const ct=.3;class lt{constructor(e,t,s){this.gl=e,this.targets=t,this.blendTarget=new bs(e,s),this.projection=new zs(e),this.vertices=e.createVertexArray()}compileTime=0;compiled=0;programs=new Map;blendTarget;projection;vertices;uploadedOrder=null;draw(e){const{gl:t,blendTarget:s}=this,{store:n,camera:o,normals:i,rows:a,columns:c}=e,l=this.project(e);s.begin(this.targets.width,this.targets.height,i),t.enable(t.SCISSOR_TEST),t.scissor(c.first,a.first,c.count,a.count);const h=s.formats.isByte?1/Os(n.header,o):1;l>0&&this.blend(l,i,h),this.resolve(i,h,e.background),t.disable(t.SCISSOR_TEST)}bindVertices(){this.gl.bindVertexArray(this.vertices)}dispose(){const{gl:e}=this;this.uploadedOrder=null,this.blendTarget.dispose(),this.projection.dispose();for(const{program:t}of this.programs.values())e.deleteProgram(t);this.programs.clear(),e.deleteVertexArray(this.vertices)}project({store:e,changed:t,camera:s,near:n,order:o,normals:i}){const{gl:a}=this,{degree:c,antialiased:l,steps:h,log_scales:u,color_step:d}=e.header,f=o.numbers.length;if(f===0)return 0;const{program:m,uniform:p}=this.programFor(`project${c}${l}${i}`,()=>F(a,W,Fs({degree:c,antialiased:l,normals:i}))),{projection:y}=this;return(y.reserve(f,i)||this.uploadedOrder!==o)&&y.put(o.numbers),this.uploadedOrder=o,y.bind(f,i),a.useProgram(m),this.bindVertices(),this.setView(p,e,s,n),c>0&&a.uniform1fv(p("steps"),h),a.uniform1ui(p("own"),e.count),a.uniform1f(p("logLow"),u[0]),a.uniform1f(p("logStep"),(u[1]-u[0])/65535),a.uniform1f(p("colorStep"),d),a.uniform1ui(p("count"),f),this.bind(p,"order",y.order,0),this.bind(p,"records",e.records.texture,1),this.bind(p,"harmonics",e.harmonics.texture,2),this.bind(p,"changed",(t??e.records).texture,3),a.drawArrays(a.TRIANGLES,0,3),f}blend(e,t,s){const{gl:n}=this,o=t?["NORMALS"]:[],{program:i,uniform:a}=this.programFor(`blend${t}`,()=>F(n,me(Ls,o),me(Bs,o)));n.useProgram(i),this.bindVertices(),["places","shapes","tints",...t?["normals"]:[]].forEach((l,h)=>this.bind(a,l,this.projection.outputs[h],h)),n.uniform2f(a("size"),this.targets.width,this.targets.height),n.uniform1f(a("unit"),s),n.enable(n.BLEND),n.blendEquation(n.FUNC_ADD),n.blendFunc(n.ONE,n.ONE_MINUS_SRC_ALPHA),n.drawArrays(n.TRIANGLES,0,6*e),n.disable(n.BLEND)}resolve(e,t,s){const{gl:n}=this,{program:o,uniform:i}=this.programFor(`resolve${e}`,()=>F(n,W,me(Is,e?["NORMALS"]:[])));this.targets.bind(e),n.useProgram(o),this.bindVertices();const{color:a,distance:c,normal:l}=this.blendTarget.textures;this.bind(i,"gathered",a,0),this.bind(i,"distances",c,1),l&&e&&this.bind(i,"axes",l,2),n.uniform3f(i("background"),...s),n.uniform1f(i("unit"),t),n.drawArrays(n.TRIANGLES,0,3)}bind(e,t,s,n){const{gl:o}=this;o.activeTexture(o.TEXTURE0+n),o.bindTexture(o.TEXTURE_2D,s),o.uniform1i(e(t),n)}setView(e,{header:t},s,n){const{gl:o}=this,{width:i,height:a}=this.targets,{c2w:c}=s,[l,h]=[s.fx,s.cx].map(y=>y*i/s.width),[u,d]=[s.fy,s.cy].map(y=>y*a/s.height),[f,m]=[.5*ct*i/l,.5*ct*a/u];o.uniform3f(e("eye"),...de(t,s));const p=[c[0],-c[1],-c[2],c[4],-c[5],-c[6],c[8],-c[9],-c[10]];o.uniformMatrix3fv(e("W"),!1,p),o.uniform2f(e("focal"),l,u),o.uniform2f(e("center"),h,d),o.uniform2f(e("size"),i,a),o.uniform4f(e("limits"),-h/l-f,(i-h)/l+f,-d/u-m,(a-d)/u+m),o.uniform1f(e("near"),ot(t,n))}programFor(e,t){let s=this.programs.get(e);return s||(s=t(),this.programs.set(e,s),this.compileTime=s.milliseconds,this.compiled+=1),s}}const ht=128;class H{constructor(e,t){this.gl=e,this.rows=Math.max(1,Math.ceil(t/(4*v)));const s=te(e,e.MAX_TEXTURE_SIZE);if(this.rows>s)throw new I(`the splats take ${this.rows} rows of a texture, more than the ${s} that the GPU has`);for(;e.getError()!==e.NO_ERROR;);if(this.texture=e.createTexture(),e.bindTexture(e.TEXTURE_2D,this.texture),e.texStorage2D(e.TEXTURE_2D,1,e.RGBA32UI,v,this.rows),Y(e,e.TEXTURE_2D,e.NEAREST),e.bindTexture(e.TEXTURE_2D,null),e.getError()===e.OUT_OF_MEMORY)throw this.dispose(),new Error("the GPU has not enough memory for the splats")}texture;rows;stride=4*v;async uploadRange(e,t,s,n){const{stride:o}=this;for(let i=Math.floor(t/o);i*o<s;i+=ht){if(i*o>t&&await new Promise(a=>setTimeout(a)),!n())return;this.uploadRows(e,i,Math.min(i+ht,Math.ceil(s/o)))}}uploadRows(e,t,s){const{gl:n,stride:o}=this;let i=e.subarray(t*o,s*o);if(i.length<(s-t)*o){const a=new Uint32Array((s-t)*o);a.set(i),i=a}N(n),n.bindTexture(n.TEXTURE_2D,this.texture),n.texSubImage2D(n.TEXTURE_2D,0,0,t,v,s-t,n.RGBA_INTEGER,n.UNSIGNED_INT,i),n.bindTexture(n.TEXTURE_2D,null)}dispose(){this.gl.deleteTexture(this.texture)}}const ut=16*(pe+1)+4;class Ps{constructor(e,t,s){this.gl=e,this.header=t;const{degree:n}=t,o=X(n),i=4*(S+o)+ut,a=t.nodes?Math.min(t.count,Math.floor(s/i)):t.count;if(this.capacity=a,this.bytes=i*a,this.bytes>s)throw new I(`the splats take ${Math.ceil(this.bytes/2**20)} MiB of the GPU, more than the ${Math.floor(s/2**20)} allowed`);this.means=new Float32Array(3*a),this.words=new Uint32Array(S*a),this.harmonicWords=new Uint32Array(o*a),this.set={means:this.means.subarray(0,0),hidden:null,changed:null},this.records=new H(e,this.words.length),this.harmonics=new H(e,this.harmonicWords.length)}set;records;harmonics;bytes;capacity;stored=0;hidden=null;waiting=[];means;words;harmonicWords;get count(){return this.set.means.length/3}get isWhole(){return this.count===this.header.count}async take(e,t){this.means.set(e.means,3*e.first),this.words.set(e.records,S*e.first),this.harmonicWords.set(e.harmonics,X(e.header.degree)*e.first),await this.upload(e.first,e.first+e.count,t)}hasRoomFor(e){return this.stored+e<=this.capacity}async storeNode(e,t,s){const n=this.stored,o=X(e.header.degree);this.means.set(e.means,3*n),this.words.set(e.records,S*n),this.harmonicWords.set(e.harmonics,o*n);const i=n+e.count;await this.records.uploadRange(this.words,S*n,S*i,s),await this.harmonics.uploadRange(this.harmonicWords,o*n,o*i,s),this.stored=i,this.waiting.push(t)}setWithNodes(){if(this.waiting.length===0)return null;const e=new Uint8Array(this.stored);this.hidden&&e.set(this.hidden);for(const[t,s]of this.waiting.splice(0))e.fill(1,t,s);return this.hidden=e,{means:this.means.subarray(0,3*this.stored),hidden:e,changed:null}}async restore(e){const{count:t}=this;this.records=new H(this.gl,this.words.length),this.harmonics=new H(this.gl,this.harmonicWords.length),this.set={...this.set,means:this.means.subarray(0,0)},await this.upload(0,t,e)}dispose(){this.records.dispose(),this.harmonics.dispose()}async upload(e,t,s){const n=X(this.header.degree);await this.records.uploadRange(this.words,S*e,S*t,s),s()&&await this.harmonics.uploadRange(this.harmonicWords,n*e,n*t,s),s()&&(this.stored=Math.max(this.stored,t),this.set={means:this.means.subarray(0,3*t),hidden:this.hidden?.slice(0,t)??null,changed:null})}}const Xs=768*2**20;class dt{constructor(e,t=Xs,s=null){this.gl=e,this.memory=t,this.targets=new Pe(e),this.viewPasses=new Xe(e,this.targets),this.passes=new lt(e,this.targets,s??tt(e))}background=[1,1,1];near=0;edited=!0;targets;inBands=!1;inOrder=!0;level=null;uploaded={last:0,total:0};viewPasses;sorters={before:new nt,after:new nt};passes;store=null;changed=null;prepared=null;camera=null;loading=0;set onOrder(e){for(const t of Object.values(this.sorters))t.onOrder=e}get editable(){return this.count>0}get count(){return this.store?.count??0}get bytes(){return this.store?.bytes??0}get compileTime(){return this.passes.compileTime}get compiled(){return this.passes.compiled}get sortedHere(){return this.sorters.before.sortedHere+this.sorters.after.sortedHere}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const s=++this.loading,n=()=>s===this.loading;let o=0,i=null,a=0;const c=l=>{n()&&(i=new Ps(this.gl,l,this.memory))};try{const l=u=>{a=u,t.onArrival?.(u)};for await(const u of Ye(e,c,l)){const d=i;if(!n()||d===null||(await d.take(u,n),!n()))return;this.store!==d&&(this.store?.dispose(),this.store=d),this.level={field:{background:u.header.background},last:u.last},t.onLevel?.(++o,u.header.levels.length)}const h=i;h?.header.nodes&&t.openBeside&&await this.loadNodes(h,h.header.nodes,t.openBeside,a,t,n)}finally{const l=i;l!==null&&this.store!==l&&l.dispose()}}async loadNodes(e,t,s,n,o,i){const a=[...t];let c=0,l=n,h=Promise.resolve(),u=!1,d=Promise.resolve();const f=()=>{u||(u=!0,h=this.applyNodes(e,i).finally(()=>{u=!1,i()&&o.onDetails?.()}))},m=async y=>{let w=0;const E=g=>{l+=g-w,w=g,o.onArrival?.(l)};for await(const g of Ye(await s(y.url),()=>{},E))d=d.then(async()=>{i()&&(e.hasRoomFor(g.count)?await e.storeNode(g,y.coarse,i):c+=1)}),await d;f()},p=async()=>{for(let y=it(a,this.camera);y&&i();y=it(a,this.camera))e.hasRoomFor(y.count)?await m(y):c+=1};await Promise.all([p(),p()]),await h,await this.applyNodes(e,i),i()&&(c>0&&o.onCoarse?.(c,t.length),this.level={field:{background:e.header.background},last:!0},o.onLevel?.(2,2))}async applyNodes(e,t){const s=e.setWithNodes();if(s===null)return;const{camera:n}=this;n!==null&&await this.sorters.before.prepare(s,fe(e.header,n,this.near)),t()&&(e.set=s)}async restore(){const{gl:e,store:t,changed:s}=this;this.changed=null,this.targets.forget(),this.viewPasses.forget(),this.passes=new lt(e,this.targets,tt(e));const n=++this.loading;await t?.restore(()=>n===this.loading),this.setEdits(s?.edits??null)}async readEdits(e){return await et(e)}async prepare(e){const{store:t,camera:s}=this;if(t===null||s===null||!this.edited||e.changed===0||e.count!==t.header.count)return;const n=pt(e,t);this.prepared={edits:e,set:n,own:t.set},await this.sorters.after.prepare(n,fe(t.header,s,this.near))}setEdits(e){const{prepared:t}=this;if(this.changed?.texture.dispose(),this.changed=this.prepared=null,this.uploaded.last=0,e===null||e.changed===0&&!e.hidden.includes(1))return;if(this.store!==null&&e.count!==this.store.header.count)throw new Error(`edits of ${e.count} splats, the page has ${this.store.header.count}; reload it`);const s=this.bytes+(4*Z+ut)*e.changed;if(s>this.memory)throw new I(`the edited splats take ${ft(s)} MiB of the GPU, more than the ${ft(this.memory)} allowed`);const n=new H(this.gl,e.records.length);e.changed>0&&n.uploadRows(e.records,0,Math.ceil(e.records.length/n.stride));const{set:o,own:i}=t?.edits===e?t:{set:null,own:null};this.changed={edits:e,texture:n,set:o,own:i},this.uploaded.last=e.changed>0?e.records.byteLength:0,this.uploaded.total+=this.uploaded.last}render(e={}){const{gl:t,store:s,camera:n,background:o,near:i}=this;if(!s||s.count===0||!n||t.isContextLost())return!1;const{width:a,height:c}=this.targets,l=this.shownSet(s),h=fe(s.header,n,i),d=(l===s.set?this.sorters.before:this.sorters.after).orderFor(l,h,e.sorted??!1);this.inOrder=ue(d.depths,h),z(t);const f=e.rows??{first:0,count:c},m=e.columns??{first:0,count:a},p=this.changed?.texture??null;return this.passes.draw({store:s,changed:p,camera:n,near:i,order:d,normals:e.normals??!1,background:o,rows:f,columns:m}),P(t),!0}show(e,t,s=null,n="color"){const{gl:o}=this;o.bindFramebuffer(o.FRAMEBUFFER,s),this.passes.bindVertices(),z(o),this.viewPasses.show(n,this.reach,e,t),P(o)}read(e=!1){return this.targets.read(e)}distances(e){this.passes.bindVertices(),z(this.gl);const t=this.viewPasses.distances(e);return P(this.gl),t}wait(){this.targets.wait()}dispose(){this.loading++,this.setEdits(null),this.store?.dispose(),this.store=this.level=null;for(const e of Object.values(this.sorters))e.dispose();this.viewPasses.dispose(),this.targets.dispose(),this.passes.dispose()}shownSet(e){const{changed:t}=this;return!this.edited||t===null?e.set:((t.set===null||t.own!==e.set)&&(t.own=e.set,t.set=pt(t.edits,e)),t.set)}get reach(){const{store:e,camera:t}=this;return!e||!t?[0,1]:Oe(e.header.bounds,t)}}const ft=r=>Math.ceil(r/2**20);function pt(r,e){return{means:e.set.means,hidden:r.hidden,changed:Gs(r,e)}}function Gs({means:r,records:e,changed:t},s){if(s.isWhole)return r;const n=Float32Array.from(r);for(let o=0;o<t;o++)e[Z*o+3]>=s.count&&(n[3*o]=NaN);return n}const R=(r,e,t=1)=>[r[0]+t*e[0],r[1]+t*e[1],r[2]+t*e[2]],A=(r,e)=>R(r,e,-1),V=(r,e)=>[e*r[0],e*r[1],e*r[2]],M=(r,e)=>r[0]*e[0]+r[1]*e[1]+r[2]*e[2],G=(r,e)=>[r[1]*e[2]-r[2]*e[1],r[2]*e[0]-r[0]*e[2],r[0]*e[1]-r[1]*e[0]],k=r=>Math.hypot(...r),D=r=>V(r,1/Math.max(1e-30,k(r)));function ye(r,e,t){const[s,n]=[Math.cos(t),Math.sin(t)];return R(R(V(r,s),G(e,r),n),e,M(e,r)*(1-s))}const U=(r,e)=>[r[e],r[4+e],r[8+e]];function mt(r,e,t,s){return[0,1,2].flatMap(n=>[r[n],e[n],t[n],s[n]]).concat(0,0,0,1)}const $s=.02,Ws=.01;function Hs(r,e){const{c2w:t,eye:s}=r.orbit,{clientWidth:n,clientHeight:o}=r.canvas,i=A(e,s),a=-M(i,U(t,2));if(a<=0)return{x:0,y:0,seen:!1};const c=.5*n+r.focal*M(i,U(t,0))/a,l=.5*o-r.focal*M(i,U(t,1))/a;if(c<0||l<0||c>=n||l>=o)return{x:c,y:l,seen:!1};const h=k(i),u=$s*h+Ws*r.extent;return{x:c,y:l,seen:Vs(r.distances,c/n,l/o)>=h-u}}function Vs(r,e,t){if(r===null)return 1/0;const{width:s,height:n,values:o}=r;return o[Math.floor(t*n)*s+Math.floor(e*s)]}class qs{constructor(e,t,s,n){this.host=e,this.hotspots=t,this.card=n,this.marks=t.map((o,i)=>{const a=document.createElement("button");return a.textContent=String(i+1),a.title=o.title,a.hidden=!0,a.onclick=()=>this.open(i),a}),s.replaceChildren(...this.marks)}shown=null;marks;card;open(e){const t=this.hotspots[e];this.shown=e,this.part("h2").textContent=t.title,this.part("p").textContent=t.text,this.part(".count").textContent=`${e+1} / ${this.hotspots.length}`,this.card.hidden=!1,this.marks.forEach((s,n)=>s.classList.toggle("on",n===e)),this.host.flyTo(t.view,t.position)}step(e){const t=this.hotspots.length;if(t===0)return;const s=e>0?-1:t;this.open(((this.shown??s)+e+t)%t)}close(){this.shown=null,this.card.hidden=!0;for(const e of this.marks)e.classList.remove("on")}arrange(){this.marks.forEach((e,t)=>{const{x:s,y:n,seen:o}=Hs(this.host,this.hotspots[t].position);e.hidden=!o,o&&(e.style.transform=`translate(${s}px, ${n}px)`)})}part(e){const t=this.card.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}}const js=140,xe=[["km",1e3],["m",1],["cm",.01],["mm",.001]];function Ys(r){const e=js*r,t=10**Math.floor(Math.log10(e)),s=t*(e/t>=5?5:e/t>=2?2:1),[n,o]=xe.find(([,i])=>s>=i*(1-1e-9))??xe[xe.length-1];return{label:`${Number((s/o).toPrecision(6))} ${n}`,pixels:s/r}}function Ks(r,e,t,s){const n=k(A(e.eye,e.target)),{label:o,pixels:i}=Ys(s*n/t);r.style.width=`${i}px`,r.textContent=o,r.hidden=!1}const yt=new Map;function xt(r){let e=yt.get(r);if(!e){let t;const s=new ReadableStream({start:n=>void(t=n)});if(!t)throw new Error("a stream without a controller");yt.set(r,e={stream:s,controller:t})}return e}function Js(r,e){document.currentScript?.remove();const{controller:t}=xt(r);try{e===null?t.close():t.enqueue(Zs(e))}catch{}}function Zs(r){const e=atob(r),t=new Uint8Array(e.length);for(let s=0;s<e.length;s++)t[s]=e.charCodeAt(s);return t}async function we(r,{url:e}){return e===void 0?xt(r).stream:await wt(e)}async function wt(r){if(location.protocol==="file:")throw new Error("A browser does not let a page read files beside it on a disk: serve the folder (python -m http.server), or export a single .html file.");const e=await fetch(r);if(!e.ok||e.body===null)throw new Error(`${r} cannot be loaded (${e.status}); reload the page.`);return e.body}async function gt(r){return await new Response(r).arrayBuffer()}const ge=[1,.75,.5,.35,.25,.18,.12],Qs=.25,er=16,tr=4,sr=.3;class rr{constructor(e=28,t=40){this.frameBudget=e,this.bandBudget=t}cost=null;record(e,t){const s=t/Math.max(1,e);this.cost=this.cost===null?s:this.cost+sr*(s-this.cost)}scale(e,t){const{cost:s}=this;if(s===null)return Qs;const n=o=>s*e*t*o*o<=this.frameBudget;return ge.find(n)??ge[ge.length-1]}bandRows(e,t){if(this.cost===null)return er;const s=Math.floor(this.bandBudget/Math.max(1e-9,this.cost*e));return Math.max(tr,Math.min(t,s))}}async function nr(r){const e=performance.now(),t=r.fenceSync(r.SYNC_GPU_COMMANDS_COMPLETE,0);if(r.flush(),t===null)return 0;for(;!r.isContextLost()&&r.clientWaitSync(t,0,0)===r.TIMEOUT_EXPIRED;)await new Promise(s=>setTimeout(s,1));return r.deleteSync(t),performance.now()-e}const Et=8;function or(r,e,t){return r==="splats"?new dt(e,t):new Ge(e,t)}function vt(r){return String.fromCharCode(...r.subarray(0,Et))}async function ir(r){const e=r.getReader(),t=[];let s=0;for(;s<Et;){const{value:a,done:c}=await e.read();if(c)break;t.push(a),s+=a.length}const n=new Uint8Array(s);let o=0;for(const a of t)n.set(a,o),o+=a.length;const i=new ReadableStream({start:a=>a.enqueue(n),pull:async a=>{const{value:c,done:l}=await e.read();l?a.close():a.enqueue(c)},cancel:async a=>await e.cancel(a)});return{kind:vt(n)===je?"splats":"voxels",source:i}}function ar({stills:r,seconds:e,loop:t},s){const n=e>0?s/e:1,o=r.length-1,i=t?n%1*r.length:Math.min(n,1)*o,a=r[Math.min(Math.floor(i),o)],c=r[t?(Math.floor(i)+1)%r.length:Math.min(Math.floor(i)+1,o)],l=i-Math.floor(i),h=m=>R(U(a.c2w,m),A(U(c.c2w,m),U(a.c2w,m)),l),u=D(h(2)),d=h(1),f=D(A(d,[u[0]*M(d,u),u[1]*M(d,u),u[2]*M(d,u)]));return{c2w:mt(G(f,u),f,u,h(3)),fov_y_deg:a.fov_y_deg+l*(c.fov_y_deg-a.fov_y_deg)}}function Tt(r,e){const t=r.length-1;let s=0;for(;s<t-1&&r[s+1]<=e;)s++;const n=(e-r[s])/Math.max(1e-9,r[s+1]-r[s]);return{first:s,share:Math.max(0,Math.min(1,n))}}function cr(r,e,t,s){const n=t*t*(3-2*t),o=R(r.target,A(e.target,r.target),n),[i,a]=[r,e].map(({eye:h,target:u})=>A(h,u)),c=k(i)**(1-n)*k(a)**n,l=lr(D(i),D(a),n,s);return{eye:R(o,V(l,c)),target:o,fov_y_deg:r.fov_y_deg+n*(e.fov_y_deg-r.fov_y_deg)}}function lr(r,e,t,s){const n=Math.acos(Math.max(-1,Math.min(1,M(r,e))));if(n<1e-9)return e;const o=G(r,e);return ye(r,D(k(o)>1e-9?o:s),t*n)}const Rt=.02;class Ee{constructor(e,t,s){this.up=t,this.eye=U(e,3);const n=V(U(e,2),-1);this.target=R(this.eye,n,Math.max(M(A(s,this.eye),n),.001))}eye;target;get c2w(){const e=D(A(this.eye,this.target)),t=D(G(this.up,e));return mt(t,G(e,t),e,this.eye)}turn(e,t){const s=ye(A(this.eye,this.target),this.up,-e),n=D(G(this.up,s)),o=Math.acos(Math.max(-1,Math.min(1,M(D(s),this.up)))),i=Math.max(Rt,Math.min(Math.PI-Rt,o-t))-o;this.eye=R(this.target,ye(s,n,i))}shift(e,t,s){const n=2*s*k(A(this.eye,this.target)),{c2w:o}=this,i=R(V(U(o,0),-e*n),U(o,1),t*n);this.eye=R(this.eye,i),this.target=R(this.target,i)}zoom(e){this.eye=R(this.target,A(this.eye,this.target),e)}}const bt=65536;let q=null;function hr(){if(q)return q;q=new Float32Array(bt);for(let r=0;r<bt;r++){const e=r>>10&31,t=r&1023,s=e===0?t*2**-24:(1+t/1024)*2**(e-15);q[r]=r&32768?-s:s}return q}const At=new Float32Array(1),_t=new Uint32Array(At.buffer);function ur(r){At[0]=r;const e=_t[0]>>>16&32768,t=_t[0]&2147483647;return t>=947912704?e|t-939524096+4095+(t>>>13&1)>>>13:e|Math.round(Math.abs(r)*2**24)}function dr(r,e,t){const s=hr(),n=new Uint16Array(r.length);for(let o=0;o<n.length;o++){const i=s[r[o]];n[o]=ur(i+t*(s[e[o]]-i))}return n}const{BOX_ROWS:fr,BOX_VECTOR:pr,EDIT_ROWS:Q,GRADE_SCALARS:mr,HEXAHEDRON:ve,HEXAHEDRON_ROWS:St,Y_BOX_VECTOR:Ot}=b,yr=[pr,ve+Ot,ve+St+Ot];class Te{constructor(e,t,s,n,o){this.header=e,this.times=t,this.order=s,this.occupancy=n,this.states=o}static async read(e){const t=await C.open(new B(e),"cagepath",2),{header:s}=t,n=await t.read("times"),o=await t.read("states"),i=await t.read("occupancy"),a=[],c=[];for(const d of s.edits.keys())a.push(await t.read(`rows.${d}`));for(let d=0;d<s.stored;d++)c.push({key:`${d}`,halves:se(await t.read(`lattice.${d}`))});const l=[];for(const[d,f]of s.layer_keys.entries())l.push(await Ne(t,`layer.${d}`,f));const h=s.edits.map((d,f)=>{const m=s.layers[f].map(([p,y,w,E])=>({layer:l[p],place:y,first:w,end:E}));return{edits:d,boxes:s.boxes[f],rows:a[f],lattices:s.lattices[f].map(p=>c[p]),layers:m}}),u={key:"path",origin:s.origin,dims:s.dims,codes:i,changed:null};return new Te(s,n,o,u,h)}at(e){const{order:t,states:s}=this,{first:n,share:o}=Tt(this.times,e),i=s[t[n]],a=s[t[n+1]],c=o<.5?i:a;if(i===a||!xr(i,a))return this.edits(c,c.rows,c.lattices);const l=i.lattices.map((h,u)=>h===a.lattices[u]?h:{key:`${h.key} ${a.lattices[u].key} ${o}`,halves:dr(h.halves,a.lattices[u].halves,o)});return this.edits(i,gr(i,a,o),l)}edits({edits:e,boxes:t,layers:s},n,o){return{edits:e,boxes:t,preserveOpacity:this.header.preserve_opacity,rows:n,lattices:o,layers:s,occupancy:this.occupancy}}}function xr(r,e){if(r.edits!==e.edits||r.boxes!==e.boxes)return!1;for(let t=0;4*t<r.rows.length;t++)if(r.rows[4*t+3]!==e.rows[4*t+3]&&!(t<r.edits*Q&&wr(t%Q)))return!1;return!0}function wr(r){return r>=mr&&r!==ve+St}function gr({edits:r,boxes:e,rows:t},{rows:s},n){const o=t.map((a,c)=>a+n*(s[c]-a)),i=a=>{for(let c=4*a;c<4*a+3;c++)o[c]=Math.min(t[c],s[c]);for(let c=4*a+4;c<4*a+7;c++)o[c]=Math.max(t[c],s[c])};for(let a=0;a<r;a++)for(const c of yr)i(a*Q+c);for(let a=0;a<e;a++)i(r*Q+fr*a);return o}const Mt="cagesppa";class Er{constructor(e,t,s){this.rotations=e,this.scales=t,this.logs=s}made=null;get axes(){return this.made??=Ve(this.rotations,this.scales,this.logs)}}class Re{constructor(e,t,s,n){this.header=e,this.times=t,this.order=s,this.states=n}geometry=new Map;static async read(e){const t=await C.open(new B(e),Mt,2),{header:s}=t,n=await t.read("times"),o=await t.read("states"),i=new Map,a=new Map,c=(u,d)=>i.get(`${u}.${s[u][d]}`),l=(u,d)=>O(c(u,d)),h=[];for(const u of s.changed.keys()){for(const m of["hidden","sources","rotations","scales","opacities","gains"]){const p=`${m}.${s[m][u]}`;i.has(p)||i.set(p,await t.read(p))}const d=`${s.rotations[u]} ${s.scales[u]}`;a.has(d)||a.set(d,new Er(l("rotations",u),l("scales",u),s.log_scales));const f=s.after[u]<0?null:h[s.after[u]].moves;h.push({hidden:c("hidden",u),sources:c("sources",u),shapes:a.get(d),opacities:l("opacities",u),gains:c("gains",u),moves:Tr(O(await t.read(`moves.${u}`)),f)})}return new Re(s,n,o,h)}at(e){const{order:t,states:s,header:n}=this,{first:o,share:i}=Tt(this.times,e),[a,c]=[t[o],t[o+1]],l=i<.5?a:c;if((a===c||i===0||i===1)&&l===n.whole)return null;const h=s[l];let{means:u,covariances:d}=this.geometryOf(h);if(a!==c){const p=s[l===a?c:a],y=l===a?i:1-i,w=vr(h.sources,p.sources),E=this.geometryOf(p);u=Ut(u,E.means,w,3,y),d=Ut(d,E.covariances,w,6,y)}const f=h.sources.length,m=Qe(h.sources,u,d,h.opacities,h.moves.subarray(3*f,6*f),h.gains);return{count:n.count,hidden:Ze(h.hidden,n.count),changed:f,means:u,records:m}}geometryOf(e){let t=this.geometry.get(e);if(!t){t=Rr(e,this.header);for(const s of this.geometry.keys())this.geometry.size>1&&this.geometry.delete(s);this.geometry.set(e,t)}return t}}function vr(r,e){const t=new Int32Array(r.length).fill(-1);let s=0;for(let n=0;n<r.length;n++){for(;s<e.length&&e[s]<r[n];)s++;s<e.length&&e[s]===r[n]&&(t[n]=s++)}return t}function Ut(r,e,t,s,n){const o=Float32Array.from(r);for(let i=0;i<t.length;i++)if(!(t[i]<0))for(let a=0;a<s;a++)o[s*i+a]+=n*(e[s*t[i]+a]-o[s*i+a]);return o}function Tr(r,e){for(let t=0;t<r.length;t++)r[t]=(e===null?0:e[t])+(r[t]>>>1^-(r[t]&1));return r}function Rr({moves:r,shapes:e},{low:t,step:s,stretch:n}){const o=r.length/12,i=new Float32Array(3*o),{axes:a}=e,c=new Float32Array(9*o);for(let l=0;l<o;l++){const h=g=>r[g*o+l];for(let g=0;g<3;g++)i[3*l+g]=t[g]+s*h(g);const u=He(h(3),h(4),h(5)),[d,f,m,p,y,w]=[6,7,8,9,10,11].map(g=>n*(h(g)-32768)),E=[1+d,f,m,f,1+p,y,m,y,1+w];Nt(c,9*l,Nt([],0,u,0,E,0),0,a,9*l)}return{means:i,covariances:qe(c)}}function Nt(r,e,t,s,n,o){for(let i=0;i<3;i++)for(let a=0;a<3;a++){let c=0;for(let l=0;l<3;l++)c+=t[s+3*i+l]*n[o+3*l+a];r[e+3*i+a]=c}return r}const br=.0012,Ar=30,Dt=(r,e)=>Math.hypot(r.x-e.x,r.y-e.y);function _r(r,e){if(r.length===0)return;const t=r.slice(0,2),s=l=>t.reduce((h,{position:u,applied:d})=>h+u[l]-d[l],0)/t.length,[n,o]=[s("x"),s("y")],i=n!==0||o!==0,[a,c]=t;if(t.length===2){i&&e.shift(n,o);const l=Dt(a.applied,c.applied),h=Dt(a.position,c.position);l>1&&h>1&&l!==h&&e.zoom(l/h)}else i&&a.shifts?e.shift(n,o):i&&e.turn(n,o);for(const l of r)l.applied=l.position}function Sr(r,e){const t=new Map,s=()=>_r([...t.values()],e);let n=!1;r.style.touchAction="none",r.addEventListener("contextmenu",o=>o.preventDefault()),r.addEventListener("pointerdown",o=>{r.setPointerCapture(o.pointerId),s();const i={x:o.clientX,y:o.clientY},a=o.button!==0||o.shiftKey;t.set(o.pointerId,{position:i,applied:i,shifts:a})});for(const o of["pointerup","pointercancel"])r.addEventListener(o,i=>{s(),t.delete(i.pointerId)});r.addEventListener("pointermove",o=>{const i=t.get(o.pointerId);i&&(i.position={x:o.clientX,y:o.clientY},!n&&(n=!0,requestAnimationFrame(()=>{n=!1,s()})))}),r.addEventListener("wheel",o=>{o.preventDefault();const i=o.deltaMode===WheelEvent.DOM_DELTA_LINE?Ar:1;e.zoom(Math.exp(br*i*o.deltaY))},{passive:!1})}const Ct=120,Or=2,Mr=8,Ur=1e4,Nr=2500;class Dr{constructor(e,t,s,n=()=>{}){this.canvas=e,this.header=t,this.say=s,this.progressed=n;const o=e.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,powerPreference:"high-performance"});if(!o)throw new Error("This browser has no WebGL2, which the scene needs.");this.gl=o,this.orbit=new Ee(t.start.c2w,t.up,t.center),this.fov=t.start.fov_y_deg,Sr(e,{turn:(i,a)=>this.change(()=>this.orbit.turn(Math.PI*i/e.clientHeight,Math.PI*a/e.clientHeight)),shift:(i,a)=>this.change(()=>this.orbit.shift(i/e.clientHeight,a/e.clientHeight,this.halfTangent)),zoom:i=>this.change(()=>this.orbit.zoom(i))}),e.addEventListener("webglcontextlost",i=>i.preventDefault()),e.addEventListener("webglcontextrestored",()=>{this.renderer?.restore().then(()=>this.invalidate())}),new ResizeObserver(()=>this.invalidate()).observe(e)}renderer=null;orbit;gl;resolution=new rr;fov;changedAt=performance.now();nextRow=0;previewed=!1;refreshes=0;pictures=0;playStart=null;flight=null;distances=null;onFrame=null;edits=void 0;showsEdits=!0;pathEdits=null;canPlay=!1;async run(){const{files:e,background:t}=this.header;this.drawFrames();const{kind:s,source:n}=await ir(await we("field",e.field)),o=this.renderer=or(s,this.gl);o.background=t??[1,1,1],o.edited=this.showsEdits;let i;await o.load(n,{openBeside:wt,onDetails:()=>this.refresh(),onCoarse:(a,c)=>this.say(`The GPU has no room for the details of ${a} of ${c} parts.`),onArrival:a=>this.progressed(Math.min(.99,a/e.field.bytes)),onLevel:(a,c)=>{this.say(a<c?"Loading detail …":""),i??=this.loadEdits(o),this.invalidate()}}),await i,e.path&&(this.pathEdits=await Cr(await gt(await we("path",e.path)))),this.canPlay=this.header.path!==null,this.progressed(1)}async loadEdits(e){const{files:t}=this.header,s=t.edits&&await gt(await we("edits",t.edits));this.edits=s?await e.readEdits(s,null):null,e.setEdits(this.edits),this.invalidate()}get whole(){return this.nextRow===null}get edited(){return this.showsEdits}set edited(e){this.showsEdits=e,this.renderer!==null&&(this.renderer.edited=e),this.invalidate()}get plays(){return this.playStart!==null}get extent(){return this.header.extent}get focal(){return .5*Math.min(this.canvas.clientWidth,this.canvas.clientHeight)/this.halfTangent}get flies(){return this.flight!==null}flyTo(e,t){this.playStart=null,this.edits!==void 0&&this.renderer?.setEdits(this.edits);const s=new Ee(e.c2w,this.header.up,t),{eye:n,target:o}=this.orbit;this.flight={from:{eye:n,target:o,fov_y_deg:this.fov},to:{eye:s.eye,target:s.target,fov_y_deg:e.fov_y_deg},begun:matchMedia("(prefers-reduced-motion: reduce)").matches?-1/0:performance.now(),view:e,around:t},this.invalidate()}play(e){this.playStart=e&&this.canPlay?performance.now():null,this.flight=null,this.invalidate()}home(){this.playStart=this.flight=null,this.edits!==void 0&&this.renderer?.setEdits(this.edits),this.look(this.header.start)}seek(e,t){const s=e.loop?t%e.seconds:Math.min(t,e.seconds);this.pathEdits&&this.renderer?.setEdits(this.pathEdits.at(s)??this.edits??null),this.look(ar(e,s))}get halfTangent(){return Math.tan(this.fov*Math.PI/360)}look(e,t=this.header.center){this.orbit=new Ee(e.c2w,this.header.up,t),this.fov=e.fov_y_deg,this.invalidate()}change(e){this.playStart=this.flight=null,e(),this.invalidate()}invalidate(){this.changedAt=performance.now(),this.nextRow=0,this.previewed=!1}refresh(){this.refreshes++,this.nextRow=0}async drawFrames(){for(;;){await new Promise(e=>requestAnimationFrame(e));try{this.advance(),this.onFrame?.(),this.renderer!==null&&await this.draw(this.renderer)}catch(e){this.say(e instanceof Error?e.message:String(e));return}}}advance(){this.flight!==null&&this.advanceFlight(this.flight);const{path:e}=this.header;if(this.playStart===null||!e)return;const t=(performance.now()-this.playStart)/1e3;this.seek(e,t),!e.loop&&t>=e.seconds&&(this.playStart=null)}advanceFlight({from:e,to:t,begun:s,view:n,around:o}){const i=(performance.now()-s)/Nr;if(i>=1){this.flight=null,this.look(n,o);return}const{eye:a,target:c,fov_y_deg:l}=cr(e,t,i,this.header.up);this.orbit.eye=a,this.orbit.target=c,this.fov=l,this.invalidate()}async draw(e){const{canvas:t,gl:s,resolution:n}=this;if(this.nextRow===null||e.level?.last&&this.edits===void 0)return;const o=Math.min(devicePixelRatio,Or),[i,a]=[t.clientWidth,t.clientHeight].map(g=>Math.max(1,Math.round(g*o)));(t.width!==i||t.height!==a)&&Object.assign(t,{width:i,height:a});const c=n.scale(i,a),l=this.previewed&&performance.now()-this.changedAt>Ct||c===1,[h,u]=l?[i,a]:[i,a].map(g=>Math.max(Mr,Math.round(g*c)));this.setCamera(e,h,u);const d=l?this.nextRow:0,m=l&&e.inBands?Math.min(n.bandRows(i,a),a-d):u,{changedAt:p,refreshes:y}=this,w=performance.now()-p>Ct;if(!e.render({rows:{first:d,count:m},sorted:w}))return;const E=d+m>=u;if(E&&(e.show(i,a),this.header.hotspots&&(this.distances=e.distances(Ur)),this.pictures++),n.record(h*m,await nr(s)),this.changedAt===p){if(this.previewed=!0,this.refreshes!==y)return void(this.nextRow=0);l&&(this.nextRow=E?e.inOrder?null:0:d+m)}}setCamera(e,t,s){const n=.5*Math.min(t,s)/this.halfTangent,{c2w:o}=this.orbit;e.setSize(t,s),e.setCamera({c2w:o,width:t,height:s,fx:n,fy:n,cx:t/2,cy:s/2})}}async function Cr(r){return vt(new Uint8Array(r))===Mt?await Re.read(r):await Te.read(r)}window.cagefieldViewer={FieldRenderer:Ge,readEdits:Ce,SplatRenderer:dt,readSplatEdits:Je,readEditsBeside:et,take:Js};function _(r){const e=document.querySelector(r);if(!e)throw new Error(`the page has no ${r}`);return e}async function kr(r){const e=_(".message"),t=_(".arrived"),s=n=>void(e.textContent=n);try{const n=new Dr(_("canvas"),r,s,h=>{t.value=h,t.hidden=h>=1});window.cagefieldViewer.viewer=n;const[o,i,a]=[_(".compare"),_(".play"),_(".home")];o.hidden=!r.files.edits,o.onclick=()=>n.edited=!n.edited,i.onclick=()=>n.play(!n.plays),a.onclick=()=>n.home();const c=Fr(n,r),l=_(".scale");n.onFrame=()=>{c.arrange(),r.meters_per_unit!==void 0&&Ks(l,n.orbit,n.focal,r.meters_per_unit)},setInterval(()=>{i.hidden=!n.canPlay,i.textContent=n.plays?"Stop":"Play",o.textContent=n.edited?"Show before":"Show after"},100),window.addEventListener("keydown",({key:h,target:u})=>{h==="b"&&o.click(),h===" "&&!(u instanceof HTMLButtonElement)&&i.click(),h==="h"&&a.click(),h==="ArrowRight"&&c.step(1),h==="ArrowLeft"&&c.step(-1),h==="Escape"&&c.close()}),await n.run()}catch(n){t.hidden=!0,s(n instanceof Error?n.message:String(n))}}function Fr(r,e){const t=_(".card"),s=new qs(r,e.hotspots??[],_(".hotspots"),t);window.cagefieldViewer.hotspots=s;for(const[n,o]of[[".previous",-1],[".next",1]]){const i=_(n);i.hidden=s.hotspots.length===0,i.onclick=()=>s.step(o)}return _(".close").onclick=()=>s.close(),s}const kt=document.getElementById("scene");kt&&kr(JSON.parse(kt.textContent))})();
