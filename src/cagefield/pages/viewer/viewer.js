(function(){"use strict";function ee(r){return Object.entries(r).map(([e,t])=>`#define ${e} ${t}`).join(`
`)}function L(r,e,t){const s=performance.now(),n=r.createProgram();for(const[a,c]of[[r.VERTEX_SHADER,e],[r.FRAGMENT_SHADER,t]]){const l=r.createShader(a);if(l===null)throw new Error("the GPU's context is lost");r.shaderSource(l,c),r.compileShader(l),r.attachShader(n,l),r.deleteShader(l)}if(r.linkProgram(n),!r.getProgramParameter(n,r.LINK_STATUS)&&!r.isContextLost()){const c=(r.getAttachedShaders(n)??[]).map(l=>r.getShaderInfoLog(l)??"");throw new Error(`a shader does not compile: ${c.join(" ")} ${r.getProgramInfoLog(n)??""}`)}const i=new Map;return{program:n,uniform:a=>{const c=i.get(a);if(c!==void 0)return c;const l=r.getUniformLocation(n,a);return i.set(a,l),l},milliseconds:performance.now()-s}}class be extends Error{constructor(){super("the GPU has not enough memory for the field")}}function j(r){for(let e=r.getError();e!==r.NO_ERROR&&e!==r.CONTEXT_LOST_WEBGL;e=r.getError())if(e===r.OUT_OF_MEMORY)throw new be}function F(r,e,t,s){const n=r.createTexture();r.bindTexture(r.TEXTURE_3D,n),r.texStorage3D(r.TEXTURE_3D,1,e,t[0],t[1],t[2]),Y(r,r.TEXTURE_3D,s);try{j(r)}catch(i){throw r.deleteTexture(n),i}return n}function Y(r,e,t){r.texParameteri(e,r.TEXTURE_MIN_FILTER,t),r.texParameteri(e,r.TEXTURE_MAG_FILTER,t);for(const s of e===r.TEXTURE_3D?[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T,r.TEXTURE_WRAP_R]:[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T])r.texParameteri(e,s,r.CLAMP_TO_EDGE)}function N(r){r.bindBuffer(r.PIXEL_UNPACK_BUFFER,null),r.pixelStorei(r.UNPACK_ALIGNMENT,1),r.pixelStorei(r.UNPACK_FLIP_Y_WEBGL,!1),r.pixelStorei(r.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),r.pixelStorei(r.UNPACK_COLORSPACE_CONVERSION_WEBGL,r.NONE);for(const e of[r.UNPACK_ROW_LENGTH,r.UNPACK_IMAGE_HEIGHT,r.UNPACK_SKIP_PIXELS,r.UNPACK_SKIP_ROWS,r.UNPACK_SKIP_IMAGES])r.pixelStorei(e,0)}function te(r,e){return r.getParameter(e)??16384}const A={BOX_VECTOR:0,LATTICE_VECTOR:2,TO_NODES_VECTOR:3,NODE_BOX_VECTOR:6,FIRST_SCALAR:0,LAST_SCALAR:1,RESOLUTION_SCALAR:2,CONTINUOUS_SCALAR:3,SIMPLE_SCALAR:4,UNDER_SCALAR:5,NODE_SCALAR:6,PART_SCALAR:7,HEXAHEDRON:8,MATRIX_VECTOR:0,CENTER_VECTOR:3,Y_BOX_VECTOR:4,BEND_VECTOR:6,IMAGE_VECTOR:10,AFFINE_SCALAR:0,HEXAHEDRON_ROWS:18,GRADE_SCALARS:9,GRADE_DENSITY:9,GRADE_INNER:10,GRADE_OUTER:22,GRADE_COUNT:34,GRADE_FIRST_PART:17,EDIT_ROWS:44,BOX_ROWS:2,MAX_ROWS:1024,NODES_PER_TEXTURE_ROW:2048,EDGE:1e-6},Ae={BLUR:.3,SLOPE_BLUR:.02,ALPHA_MIN:.00392156862745098,ALPHA_MAX:.99,LEAST_COMPENSATION:.005},Bt=`
${ee(A)}
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

vec3 node(int n) { return texelFetch(lattice, ivec2(n & (NODES_PER_TEXTURE_ROW - 1), n >> ${Math.log2(A.NODES_PER_TEXTURE_ROW)}), 0).xyz; }

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
`,zt=2;function Pt(r){return r<=zt?r:null}function Xt(r,e){const t=A.GRADE_SCALARS+A.GRADE_DENSITY;for(let s=0;s<e;s++)if(r[4*(s*A.EDIT_ROWS+t)+3]>.5)return!0;return!1}function Gt(r,e){const{EDIT_ROWS:t,HEXAHEDRON:s,HEXAHEDRON_ROWS:n,AFFINE_SCALAR:i}=A,o=a=>r[4*a+3]??0;for(let a=0;a<e*t;a+=t){if(o(a+A.SIMPLE_SCALAR)>.5)continue;const c=[0,n].map(l=>o(a+s+l+i)>.5);if(o(a+A.FIRST_SCALAR)<.5&&!c[0]||o(a+A.LAST_SCALAR)>1.5&&!c[1])return!0}return!1}function $t(r){const e=n=>`if (place == 0 && inBox(p, rows[${n} + BOX_VECTOR].xyz, rows[${n} + BOX_VECTOR + 1].xyz)) place = mapEdit(${n}, p, v);`,s=["int mapSample(inout vec3 p, inout vec3 v) {","  int place = 0;",...(r===null?[`for (int n = editCount - 1; n >= 0; n--) { ${e("n * EDIT_ROWS")} }`]:Array.from({length:r},(n,i)=>e(`${r-1-i} * EDIT_ROWS`))).map(n=>`  ${n}`),"  return place;","}"];return Bt.replace("MAP_SAMPLE",`${s.join(`
`)}
`)}const{MAX_ROWS:_e,NODES_PER_TEXTURE_ROW:K}=A;class Wt{constructor(e){this.gl=e}uploaded={last:0,total:0};current=null;buffer=null;lattices=null;occupancy=null;get edits(){return this.current}get bricks(){return this.occupancy?.texture??null}countUpload(e){this.uploaded.last+=e,this.uploaded.total+=e}set(e){if(this.uploaded.last=0,e===null||e.edits===0){this.dispose();return}if(e.rows.length>4*_e)throw new Error("more edits than the page's shader holds");this.putRows(e),this.putLattices(e),this.putOccupancy(e),this.current=e,this.uploaded.total+=this.uploaded.last}bind(e){const{gl:t}=this;return t.uniformBlockBinding(e,t.getUniformBlockIndex(e,"Edits"),0),t.bindBufferBase(t.UNIFORM_BUFFER,0,this.buffer),this.lattices?.texture??null}forget(){this.current=this.buffer=this.lattices=this.occupancy=null}dispose(){const{gl:e}=this;e.deleteBuffer(this.buffer),e.deleteTexture(this.lattices?.texture??null),e.deleteTexture(this.occupancy?.texture??null),this.forget()}putRows({rows:e}){const{gl:t}=this,s=this.buffer===null;this.buffer??=t.createBuffer(),t.bindBuffer(t.UNIFORM_BUFFER,this.buffer),s&&t.bufferData(t.UNIFORM_BUFFER,16*_e,t.DYNAMIC_DRAW),t.bufferSubData(t.UNIFORM_BUFFER,0,e),t.bindBuffer(t.UNIFORM_BUFFER,null),this.uploaded.last+=e.byteLength}putLattices({lattices:e}){const{gl:t}=this,s=e.map(({halves:c})=>Math.ceil(c.length/(3*K))),n=Math.max(1,s.reduce((c,l)=>c+l,0));if(n>te(t,t.MAX_TEXTURE_SIZE))throw new Error("the edits' lattices do not fit into a texture of the GPU");(this.lattices===null||n>this.lattices.rows)&&(t.deleteTexture(this.lattices?.texture??null),this.lattices={texture:this.latticeTexture(n),rows:n,placed:[]});const{texture:i,placed:o}=this.lattices;N(t),t.bindTexture(t.TEXTURE_2D,i);let a=0;this.lattices.placed=e.map(({key:c,halves:l},h)=>{const d={key:c,row:a};if(o.every(u=>u.key!==c||u.row!==d.row)){const u=3*K*s[h],p=l.length===u?l:new Uint16Array(u);p!==l&&p.set(l),t.texSubImage2D(t.TEXTURE_2D,0,0,a,K,s[h],t.RGB,t.HALF_FLOAT,p),this.uploaded.last+=p.byteLength}return a+=s[h],d}),t.bindTexture(t.TEXTURE_2D,null),j(t)}latticeTexture(e){const{gl:t}=this,s=t.createTexture();return t.bindTexture(t.TEXTURE_2D,s),t.texStorage2D(t.TEXTURE_2D,1,t.RGB16F,K,e),Y(t,t.TEXTURE_2D,t.NEAREST),s}putOccupancy({occupancy:{key:e,dims:t,codes:s,changed:n}}){const{gl:i,occupancy:o}=this;if(o?.key===e)return;N(i);const a=o!==null&&o.dims.every((p,m)=>p===t[m]);a||i.deleteTexture(o?.texture??null);const c=a?o.texture:F(i,i.R16UI,[t[2],t[1],t[0]],i.NEAREST),l=a&&n?.of===o.key?n:{low:[0,0,0],dims:t,codes:s};i.bindTexture(i.TEXTURE_3D,c);const[h,d,u]=l.low;i.texSubImage3D(i.TEXTURE_3D,0,u,d,h,l.dims[2],l.dims[1],l.dims[0],i.RED_INTEGER,i.UNSIGNED_SHORT,l.codes),i.bindTexture(i.TEXTURE_3D,null),this.occupancy={texture:c,key:e,dims:t},this.uploaded.last+=l.codes.byteLength}}class I{constructor(e,t=()=>{}){this.onArrival=t,this.source=(e instanceof ArrayBuffer?new Blob([e]).stream():e).getReader()}chunks=[];buffered=0;arrived=0;source;async take(e){for(;this.buffered<e;){const{value:n,done:i}=await this.source.read();if(i)throw new Error("the file of the field is truncated");this.chunks.push(n),this.buffered+=n.length,this.arrived+=n.length,this.onArrival(this.arrived)}const t=new Uint8Array(e);let s=0;for(;s<e;){const n=this.chunks[0],i=n.subarray(0,e-s);t.set(i,s),s+=i.length,i.length===n.length?this.chunks.shift():this.chunks[0]=n.subarray(i.length)}return this.buffered-=e,t}cancel(){this.source.cancel().catch(()=>{})}}async function Ht(r){const e=new Blob([r]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(e).arrayBuffer()}class C{constructor(e,t,s){this.header=e,this.entries=t,this.reader=s}next=0;static async open(e,t,s){const n=await e.take(16),i=new DataView(n.buffer);if(String.fromCharCode(...n.subarray(0,8))!==t)throw new Error(`not a file of the kind "${t}"`);const o=i.getUint32(8,!0);if(o!==s)throw new Error(`"${t}" of version ${o}, this page reads ${s}; reload it`);const a=new TextDecoder().decode(await e.take(i.getUint32(12,!0))),c=JSON.parse(a);return new C(c,c.arrays,e)}get left(){return this.entries.slice(this.next).reduce((e,t)=>e+t.bytes,0)}async read(e){const t=this.entries.at(this.next);if(t?.name!==e)throw new Error(`the file of the field has no array "${e}" here`);this.next++;const s=await Ht(await this.reader.take(t.bytes));switch(t.type){case"u1":return new Uint8Array(s);case"u2":return new Uint16Array(s);case"i4":return new Int32Array(s);case"f4":return new Float32Array(s)}}}const Vt="cagepage",qt=1;async function*jt(r,e){const t=new I(r,e);try{const s=await C.open(t,Vt,qt);for(const[n,i]of s.header.levels.entries()){const o=await s.read(`${n}.bricks`),a=await s.read(`${n}.masks`),c=await s.read(`${n}.occupancy`),l=await Se(s,`${n}`);yield{field:s.header,header:i,last:n===s.header.levels.length-1,bricks:o,masks:a,...l,occupancy:{origin:[0,0,0],dims:i.dims,codes:c}}}}finally{t.cancel()}}async function Se(r,e){const t=se(await r.read(`${e}.density`));return{density:t,sh:Yt(await r.read(`${e}.sh`),t.length)}}function se(r){const e=r.length/2,t=new Uint16Array(e);for(let s=0;s<e;s++)t[s]=r[s]|r[e+s]<<8;return t}function Yt(r,e){if(e===0)return r;for(let t=0;t<r.length;t+=e){let s=128;for(let n=t;n<t+e;n++)r[n]=s=s+r[n]&255}return r}const re=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.y * (3.0 * d.x * d.x - d.y * d.y)","2.890611442640554 * d.x * d.y * d.z","-0.4570457994644658 * d.y * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","0.3731763325901154 * d.z * (2.0 * d.z * d.z - 3.0 * d.x * d.x - 3.0 * d.y * d.y)","-0.4570457994644658 * d.x * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","1.445305721320277 * d.z * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.x * (d.x * d.x - 3.0 * d.y * d.y)","2.5033429417967046 * d.x * d.y * (d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.y * d.z * (3.0 * d.x * d.x - d.y * d.y)","0.9461746957575601 * d.x * d.y * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-0.6690465435572892 * d.y * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.10578554691520431 * (8.0 * d.z * d.z * d.z * d.z - 24.0 * d.z * d.z * (d.x * d.x + d.y * d.y) + 3.0 * (d.x * d.x + d.y * d.y) * (d.x * d.x + d.y * d.y))","-0.6690465435572892 * d.x * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.47308734787878004 * (d.x * d.x - d.y * d.y) * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.x * d.z * (d.x * d.x - 3.0 * d.y * d.y)","0.6258357354491761 * (d.x * d.x * (d.x * d.x - 3.0 * d.y * d.y) - d.y * d.y * (3.0 * d.x * d.x - d.y * d.y))"];function Kt(r){const e=Math.ceil(3*r/4),t=[`uniform float coefficientSteps[${r}];`,...Array.from({length:e},(s,n)=>`uniform sampler3D colorAtlas${n};`),"vec3 colorAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:e},(s,n)=>`  vec4 s${n} = 255.0 * textureLod(colorAtlas${n}, at, 0.0) - 128.0;`)];for(let s=0;s<r;s++){const n=[0,1,2].map(i=>`s${3*s+i>>2}.${"xyzw"[3*s+i&3]}`);t.push(`  rgb += (coefficientSteps[${s}] * (${re[s]})) * vec3(${n.join(", ")});`)}return{source:[...t,"  return rgb;","}"].join(`
`),colors:e}}const Qt=`
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
`,Zt=`
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
`;function Jt(r,e){const{source:t,colors:s}=Kt(r.K),n=[`#define BRICK ${e}`,`#define COLORS ${s}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return r.contracted&&n.push("#define CONTRACTED"),r.edited&&n.push("#define EDITED"),r.edited&&r.graded&&n.push("#define GRADED"),r.edited&&r.bent&&n.push("#define BENT"),r.normals&&n.push("#define NORMALS"),r.count&&n.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...n,Qt,t,r.edited?$t(r.edits):"",Zt].join(`
`)}function es(r,e,t,s,n,i){const{bounds:o,contracted:a}=t.field,{resolution:c,unit:l,steps:h}=t.header,{atlasBricks:d,edge:u,dims:p}=s,f=o[1].map((x,g)=>x-o[0][g]).map((x,g)=>a?2/x:(c[g]-1)/x),y=o[0].map((x,g)=>a?.5*(x+o[1][g]):x);r.uniform3f(e("atlasScale"),1/(d[0]*u),1/(d[1]*u),1/(d[2]*u)),r.uniform3i(e("indexDims"),...p),r.uniform3i(e("bricksOrigin"),...n.origin),r.uniform3i(e("bricksDims"),...n.dims),r.uniform3i(e("resolution"),...c),r.uniform3fv(e("lower"),y),r.uniform3fv(e("scale"),f),r.uniform3fv(e("halfGrid"),c.map(x=>(x-1)/4)),r.uniform1f(e("unit"),l),r.uniform1f(e("marchStep"),a?i:i/Math.max(...f)),r.uniform1fv(e("coefficientSteps"),h)}function ts(r,e,t,{width:s,height:n}){const{c2w:i}=t,o=s/t.width,a=n/t.height;r.uniform3f(e("eye"),i[3],i[7],i[11]),r.uniformMatrix3fv(e("rotation"),!0,[i[0],i[1],i[2],i[4],i[5],i[6],i[8],i[9],i[10]]),r.uniform4f(e("lens"),t.fx*o,t.fy*a,t.cx*o,t.cy*a),r.uniform1f(e("height"),n)}function Oe([r,e],t){const s=.5*Math.hypot(...e.map((i,o)=>i-r[o])),n=Math.hypot(...e.map((i,o)=>.5*(i+r[o])-t.c2w[4*o+3]));return[Math.max(0,n-s),n+s]}class ${constructor(e,t,s,n){this.vertices=e,this.brick=t,this.low=s,this.dims=n;const i=t**3,{bricks:o,masks:a}=e;this.storedBricks=new Int32Array(o.length).fill(-1),this.slots=new Int32Array(a.length/(i/8)*i).fill(-1);let c=0;o.forEach((h,d)=>{h&&(this.storedBricks[d]=c++)});let l=0;for(let h=0;h<this.slots.length;h++)a[h>>3]>>(h&7)&1&&(this.slots[h]=l++)}slots;storedBricks;static fromLevel(e){const{brick:t}=e.field;return new $(e,t,[0,0,0],e.header.resolution.map(s=>Math.ceil(s/t)))}slot(e,t,s){const{brick:n,low:i,dims:o}=this,a=Math.floor(e/n)-i[0],c=Math.floor(t/n)-i[1],l=Math.floor(s/n)-i[2];if(a<0||c<0||l<0||a>=o[0]||c>=o[1]||l>=o[2])return-1;const h=this.storedBricks[(a*o[1]+c)*o[2]+l];return h<0?-1:this.slots[((h*n+e%n)*n+t%n)*n+s%n]}}class B extends Error{}function ne(r,e,t=0){const s=r.field.brick,n=s+1,i=r.header.resolution.map(f=>Math.ceil((f-1)/s)),o=ss(r,i),a=Math.min(255,Math.floor(e/n)),c=o.length+t,l=Math.min(a,Math.max(1,Math.ceil(Math.cbrt(c)))),h=Math.min(a,Math.max(1,Math.ceil(Math.sqrt(c/l)))),d=Math.max(1,Math.ceil(c/(l*h)));if(d>a)throw new B(`${c} bricks do not fit into textures of ${e} texels an edge`);const u=new Uint8Array(4*i[0]*i[1]*i[2]),p=[l,h,d];for(const[f,y]of o.entries())u.set(ie(f,p),4*y);const m=Math.ceil(3*r.header.steps.length/4);return{brick:s,edge:n,dims:i,atlasBricks:p,count:o.length,index:u,bricks:o,colorTextures:m}}function ie(r,[e,t]){return[r%e,Math.floor(r/e)%t,Math.floor(r/(e*t)),255]}function oe({atlasBricks:r,edge:e,colorTextures:t,index:s}){return r[0]*r[1]*r[2]*e**3*(2+4*t)+s.length}function ss(r,e){const{codes:t,dims:s}=r.occupancy,n=r.field.brick/4,i=new Uint8Array(e[0]*e[1]*e[2]);let o=0;for(let a=0;a<s[0];a++)for(let c=0;c<s[1];c++)for(let l=0;l<s[2];l++,o++)t[o]<256&&(i[(Math.floor(a/n)*e[1]+Math.floor(c/n))*e[2]+Math.floor(l/n)]=1);return Int32Array.from(i.keys()).filter(a=>i[a]===1)}class Me{constructor(e,t){this.layout=e,this.sources=t}texels(e,t,s){const{edge:n,colorTextures:i,brick:o,dims:a}=this.layout,c=t*s*n**3,l={density:new Uint16Array(c),colors:Array.from({length:i},()=>new Uint8Array(4*c).fill(128))},h=t*n,d=h*s*n;for(let u=0;u<e.length;u++){const p=e[u],m=[Math.floor(p/(a[1]*a[2])),Math.floor(p/a[2])%a[1],p%a[2]],f=u%t*n+Math.floor(u/t)*n*h;for(let y=0;y<n;y++)for(let x=0;x<n;x++)for(let g=0;g<n;g++)this.putTexel(l,f+y*d+x*h+g,m[0]*o+y,m[1]*o+x,m[2]*o+g)}return l}putTexel(e,t,s,n,i){for(const o of this.sources){const a=o.slot(s,n,i);if(a<0)continue;const{density:c,sh:l}=o.vertices,h=l.length/c.length;e.density[t]=c[a];for(let d=0;d<h;d++)e.colors[d>>2][4*t+(d&3)]=l[d*c.length+a];return}}}const Ue=1,rs=2;async function Ne(r,e,t){const s=[...await r.read(`${e}.box`)],n=await r.read(`${e}.cells`),i=await r.read(`${e}.bricks`),o=await r.read(`${e}.masks`);return{key:t,low:s.slice(0,3),dims:s.slice(3),cells:n,bricks:i,masks:o,...await Se(r,e)}}function De(r,{dims:e}){return Int32Array.from(ae(r,e,Ue))}function ns(r,e,t){const{dims:s,atlasBricks:n}=r,i=4*s[1]*s[2],o=Math.max(s[0],...e.map(c=>c.place+c.end)),a=new Uint8Array(o*i);a.set(r.index);for(const{layer:c,place:l,...h}of e){const d=l*i,[u,p]=[Math.max(0,h.first),Math.min(h.end,s[0])].map(y=>y*i);a.set(r.index.subarray(u,p),d+u);const m=t(c);let f=0;for(const y of ae(c,s,Ue))a.set(ie(m[f++],n),d+4*y);for(const y of ae(c,s,rs))a.fill(0,d+4*y,d+4*y+4)}return{dims:[o,s[1],s[2]],index:a}}function*ae({low:r,dims:e,cells:t},s,n){let i=0;for(let o=r[0];o<r[0]+e[0];o++)for(let a=r[1];a<r[1]+e[1];a++)for(let c=r[2];c<r[2]+e[2];c++,i++)t[i]===n&&(yield(o*s[1]+a)*s[2]+c)}async function Ce(r,e=null){const t=await C.open(new I(r),"cageedit",3),{header:s}=t,n=await t.read("rows"),i=[];for(const[p,{key:m}]of s.lattices.entries()){const f=[...i,...e?.lattices??[]].find(y=>y.key===m);i.push(f??{key:m,halves:se(await t.read(`lattice.${p}`))})}const o=[];for(const[p,{key:m,...f}]of s.layers.entries()){const y=[...o,...e?.layers??[]].find(({layer:x})=>x.key===m);o.push({layer:y?.layer??await Ne(t,`layer.${p}`,m),...f})}const{key:a,origin:c,dims:l,part:h}=s.occupancy,d=e?.occupancy??null;let u;if(d?.key===a)u=d;else{const p=await t.read("occupancy");if(h===null)u={key:a,origin:c,dims:l,codes:p,changed:null};else if(d?.key===h.of)u={key:a,origin:c,dims:l,codes:is(d,h.low,h.dims,p),changed:{...h,codes:p}};else throw new Error("the edits are a difference to edits that this page does not have; reload it")}return{edits:s.edits,boxes:s.boxes,preserveOpacity:s.preserve_opacity,rows:n,lattices:i,layers:o,occupancy:u}}function is({dims:r,codes:e},t,s,n){const i=e.slice();let o=0;for(let a=t[0];a<t[0]+s[0];a++)for(let c=t[1];c<t[1]+s[1];c++,o+=s[2])i.set(n.subarray(o,o+s[2]),(a*r[1]+c)*r[2]+t[2]);return i}const W=`#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;function z(r){for(const e of[r.BLEND,r.DEPTH_TEST,r.CULL_FACE,r.STENCIL_TEST,r.SCISSOR_TEST,r.DITHER])r.disable(e);r.colorMask(!0,!0,!0,!0),r.depthMask(!1)}function P(r){for(let e=15;e>=0;e--)r.activeTexture(r.TEXTURE0+e),r.bindTexture(r.TEXTURE_2D,null),r.bindTexture(r.TEXTURE_3D,null);r.bindVertexArray(null),r.bindFramebuffer(r.FRAMEBUFFER,null),r.useProgram(null)}const os=1/4,as=64;function cs(r,e,t,s){const n=te(r,r.MAX_3D_TEXTURE_SIZE),i=s(ne(e,n)),o=ne(e,n,i),a=oe(o);if(a>t)throw new B(`the field takes ${Math.ceil(a/2**20)} MiB of the GPU, more than the ${Math.floor(t/2**20)} allowed`);if(!e.last)return o;try{const c=ne(e,n,i+Math.max(as,Math.ceil(os*(o.count+i))));return oe(c)>t?o:c}catch(c){if(c instanceof B)return o;throw c}}async function ls(r,e,t,s){const n=ke(r,e,t);try{for(let i=n.next();;i=s()?n.next():n.throw(new Error("not wanted any more"))){if(i.done)return i.value;await new Promise(o=>setTimeout(o))}}catch(i){if(!s())return null;throw i}}function hs(r,e,t){const s=ke(r,e,t);for(;;){const n=s.next();if(n.done)return n.value}}function*ke(r,e,t){const{atlasBricks:s,edge:n,dims:i}=t,o=s.map(l=>l*n),a=[];let c=!1;try{const l=F(r,r.R16F,o,r.LINEAR);a.push(l);const h=Array.from({length:t.colorTextures},()=>{const m=F(r,r.RGBA8,o,r.LINEAR);return a.push(m),m}),d=new Me(t,[$.fromLevel(e)]),u=s[0]*s[1];for(let m=0;m<s[2];m++){N(r);const f=t.bricks.subarray(m*u,(m+1)*u);Le(r,{layout:t,density:l,colors:h},d.texels(f,s[0],s[1]),[0,0,m],[s[0],s[1]]),yield}N(r);const p=F(r,r.RGBA8UI,[i[2],i[1],i[0]],r.NEAREST);return a.push(p),r.texSubImage3D(r.TEXTURE_3D,0,0,0,0,i[2],i[1],i[0],r.RGBA_INTEGER,r.UNSIGNED_BYTE,t.index),r.bindTexture(r.TEXTURE_3D,null),j(r),c=!0,{layout:t,density:l,colors:h,index:p,slices:i[0],bytes:oe(t)}}finally{if(!c)for(const l of a)r.deleteTexture(l)}}function Le(r,{layout:{edge:e},density:t,colors:s},n,i,o){const a=(c,l,h,d)=>{r.bindTexture(r.TEXTURE_3D,c);const[u,p,m]=i.map(f=>f*e);r.texSubImage3D(r.TEXTURE_3D,0,u,p,m,o[0]*e,o[1]*e,e,l,h,d)};a(t,r.RED,r.HALF_FLOAT,n.density),n.colors.forEach((c,l)=>a(s[l],r.RGBA,r.UNSIGNED_BYTE,c)),r.bindTexture(r.TEXTURE_3D,null)}function Fe(r,{dims:e,codes:t}){N(r);const s=F(r,r.R16UI,[e[2],e[1],e[0]],r.NEAREST);return r.texSubImage3D(r.TEXTURE_3D,0,0,0,0,e[2],e[1],e[0],r.RED_INTEGER,r.UNSIGNED_SHORT,t),r.bindTexture(r.TEXTURE_3D,null),s}function Ie(r,e){for(const t of[e.density,e.index,...e.colors])r.deleteTexture(t)}class ds{free;allocated=new Map;constructor(e,t){this.free=Array.from({length:Math.max(0,t-e)},(s,n)=>t-1-n)}get left(){return this.free.length}get(e){return this.allocated.get(e)??null}retain(e){for(const[t,s]of this.allocated)e.has(t)||(this.free.push(...Array.from(s).reverse()),this.allocated.delete(t))}allocate(e,t){if(t>this.free.length)return null;const s=Int32Array.from({length:t},()=>this.free.pop()??-1);return this.allocated.set(e,s),s}}function us(r,e){return[...new Map(r.map(({layer:s})=>[s.key,s])).values()].reduce((s,n)=>s+De(n,e).length,0)}class Be{constructor(e,t,s){this.gl=e,this.textures=t,this.level=s;const{atlasBricks:n,count:i}=t.layout;this.allocator=new ds(i,n[0]*n[1]*n[2])}allocator;fieldVertices=null;shownKey="[]";set(e){const t=JSON.stringify(e.map(({layer:n,place:i,first:o,end:a})=>[n.key,i,o,a]));if(t===this.shownKey)return 0;this.allocator.retain(new Set(e.map(({layer:n})=>n.key)));let s=0;for(const{layer:n}of e){if(this.allocator.get(n.key))continue;const i=De(n,this.textures.layout),o=this.allocator.allocate(n.key,i.length);if(o===null)return this.shownKey="",null;s+=this.upload(n,i,o)}return s+=this.putIndex(e),this.shownKey=t,j(this.gl),s}upload(e,t,s){const{gl:n,textures:i,level:o}=this,{layout:a}=i;this.fieldVertices??=$.fromLevel(o);const c=new Me(a,[new $(e,a.brick,e.low,e.dims),this.fieldVertices]);return N(n),t.forEach((l,h)=>{const[d,u,p]=ie(s[h],a.atlasBricks);Le(n,i,c.texels([l],1,1),[d,u,p],[1,1])}),t.length*a.edge**3*(2+4*a.colorTextures)}putIndex(e){const{gl:t,textures:s}=this,{dims:n,index:i}=ns(s.layout,e,o=>this.allocator.get(o.key)??[]);return N(t),n[0]!==s.slices&&(t.deleteTexture(s.index),s.index=F(t,t.RGBA8UI,[n[2],n[1],n[0]],t.NEAREST),s.slices=n[0]),t.bindTexture(t.TEXTURE_3D,s.index),t.texSubImage3D(t.TEXTURE_3D,0,0,0,0,n[2],n[1],n[0],t.RGBA_INTEGER,t.UNSIGNED_BYTE,i),t.bindTexture(t.TEXTURE_3D,null),i.length}}class ce{constructor(e,t,s,n){this.gl=e,this.memory=t,this.level=s,this.textures=n,this.layers=s.last?new Be(e,n,s):null,this.occupancy=Fe(e,s.occupancy)}occupancy;layers;solidOccupancy=null;static async upload(e,t,s,n,i){const o=await ls(e,s,ze(e,t,s,n),i);return o&&new ce(e,t,s,o)}get layered(){return this.layers!==null}putLayers(e){if(this.layers===null)return 0;const t=this.layers.set(e);if(t!==null)return t;const{gl:s,level:n}=this,i=ze(s,this.memory,n,e);return Ie(s,this.textures),this.textures=hs(s,n,i),this.layers=new Be(s,this.textures,n),this.layers.set(e)??0}get fullOccupancy(){const{occupancy:e}=this.level;return this.solidOccupancy??=Fe(this.gl,{...e,codes:new Uint16Array(e.codes.length).fill(255)}),this.solidOccupancy}dispose(){Ie(this.gl,this.textures),this.gl.deleteTexture(this.occupancy),this.gl.deleteTexture(this.solidOccupancy)}}function ze(r,e,t,s){return cs(r,t,e,n=>t.last?us(s,n):0)}class Pe{constructor(e){this.gl=e}width=1;height=1;textures=null;framebuffer=null;get color(){return this.textures?.color??null}get normals(){return this.textures?.normals??null}get depth(){return this.textures?.depth??null}setSize(e,t){e===this.width&&t===this.height||(this.dispose(),this.width=e,this.height=t)}bind(e){const{gl:t}=this;if(this.textures&&e&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={color:this.texture(t.RGBA8,t.LINEAR),depth:this.texture(t.R32UI,t.NEAREST),normals:e?this.texture(t.RGBA8,t.NEAREST):null},this.framebuffer=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer);const{color:s,depth:n,normals:i}=this.textures;for(const[o,a]of[s,n,i].entries())a&&t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+o,t.TEXTURE_2D,a,0)}t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.drawBuffers([t.COLOR_ATTACHMENT0,t.COLOR_ATTACHMENT1,...e?[t.COLOR_ATTACHMENT2]:[]]),t.viewport(0,0,this.width,this.height)}read(e){const{gl:t,width:s,height:n}=this,i=new Uint8Array(4*s*n),o=e&&this.textures?.normals?new Uint8Array(4*s*n):null;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.pixelStorei(t.PACK_ALIGNMENT,1),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,s,n,t.RGBA,t.UNSIGNED_BYTE,i),o&&(t.readBuffer(t.COLOR_ATTACHMENT2),t.readPixels(0,0,s,n,t.RGBA,t.UNSIGNED_BYTE,o)),t.bindFramebuffer(t.FRAMEBUFFER,null);const a=le(this.readDepth(),s);return{width:s,height:n,rgba:le(i,4*s),depth:a,normals:o&&le(o,4*s)}}readBits(e,t){const{gl:s}=this,n=new Uint32Array(e*t);if(s.bindBuffer(s.PIXEL_PACK_BUFFER,null),s.pixelStorei(s.PACK_ALIGNMENT,1),s.getParameter(s.IMPLEMENTATION_COLOR_READ_FORMAT)===s.RED_INTEGER)s.readPixels(0,0,e,t,s.RED_INTEGER,s.UNSIGNED_INT,n);else{const i=new Uint32Array(4*e*t);s.readPixels(0,0,e,t,s.RGBA_INTEGER,s.UNSIGNED_INT,i);for(let o=0;o<n.length;o++)n[o]=i[4*o]}return new Float32Array(n.buffer)}wait(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.readBuffer(e.COLOR_ATTACHMENT0),e.readPixels(0,0,1,1,e.RGBA,e.UNSIGNED_BYTE,new Uint8Array(4)),e.bindFramebuffer(e.FRAMEBUFFER,null)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const s of Object.values(t))e.deleteTexture(s);e.deleteFramebuffer(this.framebuffer),this.forget()}readDepth(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.readBuffer(e.COLOR_ATTACHMENT1);const t=this.readBits(this.width,this.height);return e.bindFramebuffer(e.FRAMEBUFFER,null),t}texture(e,t){const{gl:s}=this,n=s.createTexture();return s.bindTexture(s.TEXTURE_2D,n),s.texStorage2D(s.TEXTURE_2D,1,e,this.width,this.height),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MIN_FILTER,t),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MAG_FILTER,t),s.bindTexture(s.TEXTURE_2D,null),n}}function le(r,e){const t=r.length/e;for(let s=0;s<t>>1;s++){const[n,i]=[s*e,(t-1-s)*e],o=r.slice(n,n+e);r.copyWithin(n,i,i+e),r.set(o,i)}return r}const Q=["color","depth","opacity","normals"],fs=`#version 300 es
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
  if (view == ${Q.indexOf("depth")}) {
    float far = uintBitsToFloat(texelFetch(depthBits, ivec2(at * vec2(textureSize(depthBits, 0))), 0).r);
    float share = (min(far, reach.y) - reach.x) / max(reach.y - reach.x, 1e-9);
    c.rgb = vec3((1.0 - 0.85 * clamp(share, 0.0, 1.0)) * c.a);
  } else if (view == ${Q.indexOf("opacity")}) {
    c.rgb = vec3(c.a);
  } else if (view == ${Q.indexOf("normals")}) {
    c.rgb = texture(normals, at).rgb * c.a;
  }
  color = vec4(c.rgb, 1.0);
}`,ps=`#version 300 es
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
}`;class Xe{constructor(e,t){this.gl=e,this.targets=t}programs=null;distanceTarget=null;show(e,t,s,n){const{gl:i}=this,{program:o,uniform:a}=this.compiledPrograms.show;i.viewport(0,0,s,n),i.useProgram(o),this.bind(a),i.activeTexture(i.TEXTURE2),i.bindTexture(i.TEXTURE_2D,this.targets.normals),i.uniform1i(a("normals"),2),i.uniform2f(a("size"),s,n),i.uniform2f(a("reach"),...t),i.uniform1i(a("view"),Q.indexOf(e)),i.drawArrays(i.TRIANGLES,0,3)}distances(e){const{gl:t,targets:s}=this,n=Math.max(1,Math.ceil(Math.sqrt(s.width*s.height/e))),[i,o]=[Math.ceil(s.width/n),Math.ceil(s.height/n)];this.bindDistanceTarget(i,o);const{program:a,uniform:c}=this.compiledPrograms.distances;return t.viewport(0,0,i,o),t.useProgram(a),this.bind(c),t.uniform1i(c("stride"),n),t.uniform1i(c("height"),s.height),t.drawArrays(t.TRIANGLES,0,3),t.readBuffer(t.COLOR_ATTACHMENT0),{width:i,height:o,values:s.readBits(i,o)}}forget(){this.programs=this.distanceTarget=null}dispose(){const{gl:e}=this;for(const{program:t}of Object.values(this.programs??{}))e.deleteProgram(t);e.deleteTexture(this.distanceTarget?.texture??null),e.deleteFramebuffer(this.distanceTarget?.framebuffer??null),this.forget()}get compiledPrograms(){return this.programs??={show:L(this.gl,W,fs),distances:L(this.gl,W,ps)},this.programs}bind(e){const{gl:t,targets:s}=this;t.activeTexture(t.TEXTURE0),t.bindTexture(t.TEXTURE_2D,s.color),t.uniform1i(e("picture"),0),t.activeTexture(t.TEXTURE1),t.bindTexture(t.TEXTURE_2D,s.depth),t.uniform1i(e("depthBits"),1)}bindDistanceTarget(e,t){const{gl:s}=this;if(this.distanceTarget?.width!==e||this.distanceTarget.height!==t){s.deleteTexture(this.distanceTarget?.texture??null),s.deleteFramebuffer(this.distanceTarget?.framebuffer??null);const n=s.createTexture();s.bindTexture(s.TEXTURE_2D,n),s.texStorage2D(s.TEXTURE_2D,1,s.R32UI,e,t);const i=s.createFramebuffer();s.bindFramebuffer(s.FRAMEBUFFER,i),s.framebufferTexture2D(s.FRAMEBUFFER,s.COLOR_ATTACHMENT0,s.TEXTURE_2D,n,0),this.distanceTarget={texture:n,framebuffer:i,width:e,height:t}}s.bindFramebuffer(s.FRAMEBUFFER,this.distanceTarget.framebuffer),s.drawBuffers([s.COLOR_ATTACHMENT0])}}const ms=768*2**20;class Ge{constructor(e,t=ms){this.gl=e,this.memory=t,this.targets=new Pe(e),this.viewPasses=new Xe(e,this.targets),this.editTextures=new Wt(e),this.vertices=e.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;inBands=!0;inOrder=!0;editable=!0;onOrder=null;compileTime=0;compiled=0;shownField=null;editTextures;viewPasses;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shownField?.level??null}get uploaded(){return this.editTextures.uploaded}get activeEdits(){return this.edited?this.editTextures.edits:null}get bytes(){return this.shownField?.textures.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const s=++this.loading,n=()=>s===this.loading;let i=0;for await(const o of jt(e,t.onArrival)){if(await this.take(o,n),!n())return;t.onLevel?.(++i,o.field.levels.length)}}async restore(){const{shownField:e}=this,{edits:t}=this.editTextures;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shownField=null;for(const n of[this.targets,this.viewPasses,this.editTextures])n.forget();const s=++this.loading;this.setEdits(t),e&&await this.take(e.level,()=>s===this.loading)}async readEdits(e,t){return await Ce(e,t)}async prepare(){}setEdits(e){this.editTextures.set(e),this.putLayers()}render(e={}){const{gl:t,shownField:s,camera:n,activeEdits:i}=this;if(!s||!n||t.isContextLost())return!1;const{level:o,textures:a}=s,{width:c,height:l}=this.targets,h={K:o.header.steps.length,contracted:o.field.contracted,edited:i!==null,edits:i&&Pt(i.edits),normals:e.normals??!1,graded:i!==null&&Xt(i.rows,i.edits),bent:i!==null&&Gt(i.rows,i.edits),count:e.count??!1},{program:d,uniform:u}=this.program(h,o.field.brick);this.targets.bind(h.normals),t.useProgram(d),t.bindVertexArray(this.vertices),z(this.gl);const p=i&&o.last?i.occupancy:o.occupancy;es(t,u,o,a.layout,p,this.step??o.field.step),ts(t,u,n,this.targets),t.uniform1f(u("near"),this.near),t.uniform3f(u("background"),...this.background);let m=0;const f=(E,w,T)=>{t.activeTexture(t.TEXTURE0+m),t.bindTexture(w,T),t.uniform1i(u(E),m++)};f("densityAtlas",t.TEXTURE_3D,a.density),f("brickIndex",t.TEXTURE_3D,a.index),f("bricks",t.TEXTURE_3D,i?o.last?this.editTextures.bricks:s.fullOccupancy:s.occupancy),a.colors.forEach((E,w)=>f(`colorAtlas${w}`,t.TEXTURE_3D,E)),i&&(f("lattice",t.TEXTURE_2D,this.editTextures.bind(d)),t.uniform1i(u("editCount"),i.edits),t.uniform1i(u("boxCount"),i.boxes),t.uniform1i(u("preserveOpacity"),Number(i.preserveOpacity)),t.uniform1i(u("layered"),Number(s.layered)));const{first:y,count:x}=e.rows??{first:0,count:l},g=e.columns??{first:0,count:c};return t.enable(t.SCISSOR_TEST),t.scissor(g.first,y,g.count,x),t.drawArrays(t.TRIANGLES,0,3),t.disable(t.SCISSOR_TEST),P(t),!0}show(e,t,s=null,n="color"){const{gl:i}=this;i.bindFramebuffer(i.FRAMEBUFFER,s),i.bindVertexArray(this.vertices),z(this.gl),this.viewPasses.show(n,this.reach,e,t),P(this.gl)}read(e=!1){return this.targets.read(e)}distances(e){this.gl.bindVertexArray(this.vertices),z(this.gl);const t=this.viewPasses.distances(e);return P(this.gl),t}wait(){this.targets.wait()}dispose(){this.loading++,this.drop();for(const e of[this.targets,this.viewPasses,this.editTextures])e.dispose();for(const{program:e}of this.programs.values())this.gl.deleteProgram(e);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(e,t){const s=await ce.upload(this.gl,this.memory,e,this.layers,t);s!==null&&(this.drop(),this.shownField=s,this.putLayers())}get layers(){return this.editTextures.edits?.layers??[]}putLayers(){try{this.shownField&&this.editTextures.countUpload(this.shownField.putLayers(this.layers))}catch(e){throw e instanceof be&&this.drop(),e}}drop(){this.shownField?.dispose(),this.shownField=null}get reach(){const{shownField:e,camera:t}=this;return!e||!t?[0,1]:Oe(e.level.field.bounds,t)}program(e,t){const s=JSON.stringify([e,t]);let n=this.programs.get(s);return n||(n=L(this.gl,W,Jt(e,t)),this.programs.set(s,n),this.compileTime=n.milliseconds,this.compiled+=1),n}}const $e='(function(){"use strict";class A{constructor(t,n=()=>{}){this.onArrival=n,this.source=(t instanceof ArrayBuffer?new Blob([t]).stream():t).getReader()}chunks=[];buffered=0;arrived=0;source;async take(t){for(;this.buffered<t;){const{value:s,done:c}=await this.source.read();if(c)throw new Error("the file of the field is truncated");this.chunks.push(s),this.buffered+=s.length,this.arrived+=s.length,this.onArrival(this.arrived)}const n=new Uint8Array(t);let e=0;for(;e<t;){const s=this.chunks[0],c=s.subarray(0,t-e);n.set(c,e),e+=c.length,c.length===s.length?this.chunks.shift():this.chunks[0]=s.subarray(c.length)}return this.buffered-=t,n}cancel(){this.source.cancel().catch(()=>{})}}async function b(o){const t=new Blob([o]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(t).arrayBuffer()}class d{constructor(t,n,e){this.header=t,this.entries=n,this.reader=e}next=0;static async open(t,n,e){const s=await t.take(16),c=new DataView(s.buffer);if(String.fromCharCode(...s.subarray(0,8))!==n)throw new Error(`not a file of the kind "${n}"`);const r=c.getUint32(8,!0);if(r!==e)throw new Error(`"${n}" of version ${r}, this page reads ${e}; reload it`);const a=new TextDecoder().decode(await t.take(c.getUint32(12,!0))),i=JSON.parse(a);return new d(i,i.arrays,t)}get left(){return this.entries.slice(this.next).reduce((t,n)=>t+n.bytes,0)}async read(t){const n=this.entries.at(this.next);if(n?.name!==t)throw new Error(`the file of the field has no array "${t}" here`);this.next++;const e=await b(await this.reader.take(n.bytes));switch(n.type){case"u1":return new Uint8Array(e);case"u2":return new Uint16Array(e);case"i4":return new Int32Array(e);case"f4":return new Float32Array(e)}}}function p(o,t,n){const e=o>>15|t>>15<<1,s=[o,t,n].map(h=>((h&32767)-16384)/(16383*Math.SQRT2)),c=Math.sqrt(Math.max(0,1-s[0]**2-s[1]**2-s[2]**2)),[r,a,i,f]=[...s.slice(0,e),c,...s.slice(e)];return[1-2*(i*i+f*f),2*(a*i-r*f),2*(a*f+r*i),2*(a*i+r*f),1-2*(a*a+f*f),2*(i*f-r*a),2*(a*f-r*i),2*(i*f+r*a),1-2*(a*a+i*i)]}function k(o,t,[n,e]){const s=o.length/3,c=new Float32Array(9*s);for(let r=0;r<s;r++){const a=p(o[r],o[s+r],o[2*s+r]);for(let i=0;i<3;i++){const f=Math.exp(n+(e-n)*t[i*s+r]/65535);for(let h=0;h<3;h++)c[9*r+3*h+i]=a[3*h+i]*f}}return c}function m(o){const t=new Float32Array(o.length/9*6);for(let n=0,e=0;n<o.length;n+=9)for(let s=0;s<3;s++)for(let c=s;c<3;c++){let r=0;for(let a=0;a<3;a++)r+=o[n+3*s+a]*o[n+3*c+a];t[e++]=r}return t}const v=256;function w(o){const t=o.length/2,n=new Uint16Array(t);for(let e=0;e<t;e++)n[e]=o[e]<<8|o[t+e];return n}function S(o,t,n){const e=t.length/(3*n),s=256**e-1,c=new Float32Array(3*n);for(let r=0;r<n;r++){const a=6*Math.floor(r/v);for(let i=0;i<3;i++){let f=0;for(let u=0;u<e;u++)f=256*f+t[(3*u+i)*n+r];const h=o[a+i];c[3*r+i]=h+(o[a+3+i]-h)*f/s}}return c}const U="cagesped",M=2,g=16;async function x(o){const t=await d.open(new A(o),U,M),{count:n,changed:e,packed:s,log_scales:c}=t.header,r=async y=>await t.read(y),a=async y=>await t.read(y),i=E(await r("hidden"),n),f=await t.read("sources"),h=s?S(await a("chunks"),await r("means"),e):await a("means"),u=s?m(k(w(await r("rotations")),w(await r("scales")),c)):await a("covariances"),l=w(await r("opacities")),B=w(await r("turns")),C=await t.read("gains");return{count:n,hidden:i,changed:e,means:h,records:R(f,h,u,l,B,C)}}function E(o,t){const n=new Uint8Array(t);for(let e=0;e<t;e++)n[e]=o[e>>3]>>(e&7)&1;return n}function R(o,t,n,e,s,c){const r=o.length,a=new Uint32Array(g*r),[i,f]=[new Uint32Array(t.buffer),new Uint32Array(n.buffer)];for(let h=0;h<r;h++){const u=g*h;for(let l=0;l<3;l++)a[u+l]=i[3*h+l];a[u+3]=o[h];for(let l=0;l<6;l++)a[u+4+l]=f[6*h+l];a[u+10]=s[h]|s[r+h]<<16,a[u+11]=s[2*r+h]|e[h]<<16;for(let l=0;r*l<c.length;l++)a[u+12+l]=c[r*l+h]}return a}self.onmessage=async({data:o})=>{const{file:t,answer:n}=o;try{const e=await x(t);n.postMessage({edits:e},[e.hidden.buffer,e.means.buffer,e.records.buffer])}catch(e){n.postMessage({why:e instanceof Error?e.message:String(e)})}},self.postMessage("ready")})();\n',We=typeof self<"u"&&self.Blob&&new Blob([$e],{type:"text/javascript;charset=utf-8"});function ys(r){let e;try{if(e=We&&(self.URL||self.webkitURL).createObjectURL(We),!e)throw"";const t=new Worker(e,{name:r?.name});return t.addEventListener("error",()=>{(self.URL||self.webkitURL).revokeObjectURL(e)}),t}catch{return new Worker("data:text/javascript;charset=utf-8,"+encodeURIComponent($e),{name:r?.name})}finally{e&&(self.URL||self.webkitURL).revokeObjectURL(e)}}function He(r,e,t){const s=r>>15|e>>15<<1,n=[r,e,t].map(h=>((h&32767)-16384)/(16383*Math.SQRT2)),i=Math.sqrt(Math.max(0,1-n[0]**2-n[1]**2-n[2]**2)),[o,a,c,l]=[...n.slice(0,s),i,...n.slice(s)];return[1-2*(c*c+l*l),2*(a*c-o*l),2*(a*l+o*c),2*(a*c+o*l),1-2*(a*a+l*l),2*(c*l-o*a),2*(a*l-o*c),2*(c*l+o*a),1-2*(a*a+c*c)]}function Ve(r,e,[t,s]){const n=r.length/3,i=new Float32Array(9*n);for(let o=0;o<n;o++){const a=He(r[o],r[n+o],r[2*n+o]);for(let c=0;c<3;c++){const l=Math.exp(t+(s-t)*e[c*n+o]/65535);for(let h=0;h<3;h++)i[9*o+3*h+c]=a[3*h+c]*l}}return i}function qe(r){const e=new Float32Array(r.length/9*6);for(let t=0,s=0;t<r.length;t+=9)for(let n=0;n<3;n++)for(let i=n;i<3;i++){let o=0;for(let a=0;a<3;a++)o+=r[t+3*n+a]*r[t+3*i+a];e[s++]=o}return e}const je="cagespla",ws=1,xs=256,S=8;function X(r){return 4*Math.ceil(3*((r+1)**2-1)/16)}async function*Ye(r,e,t){const s=new I(r,t);try{const n=await C.open(s,je,ws),{header:i}=n;e(i);let o=0;for(const[a,c]of i.levels.entries()){const l=c-o,h=async E=>await n.read(`${a}.${E}`),d=await n.read(`${a}.chunks`),u=Ke(d,await h("means"),l),p=await h("rotations"),m=await h("scales"),f=await h("opacities"),y=await h("colors"),x=gs(u,O(p),O(m),O(f),O(y)),g=Es(await h("sh"),l,i.degree);yield{header:i,first:o,count:l,last:a===i.levels.length-1&&!i.nodes,means:u,records:x,harmonics:g},o=c}}finally{s.cancel()}}function O(r){const e=r.length/2,t=new Uint16Array(e);for(let s=0;s<e;s++)t[s]=r[s]<<8|r[e+s];return t}function Ke(r,e,t){const s=e.length/(3*t),n=256**s-1,i=new Float32Array(3*t);for(let o=0;o<t;o++){const a=6*Math.floor(o/xs);for(let c=0;c<3;c++){let l=0;for(let d=0;d<s;d++)l=256*l+e[(3*d+c)*t+o];const h=r[a+c];i[3*o+c]=h+(r[a+3+c]-h)*l/n}}return i}function gs(r,e,t,s,n){const i=s.length,o=new Uint32Array(r.buffer),a=new Uint32Array(S*i);for(let c=0;c<i;c++){const l=S*c;a[l]=o[3*c],a[l+1]=o[3*c+1],a[l+2]=o[3*c+2],a[l+3]=n[c]|n[i+c]<<16,a[l+4]=e[c]|e[i+c]<<16,a[l+5]=e[2*i+c]|s[c]<<16,a[l+6]=t[c]|t[i+c]<<16,a[l+7]=t[2*i+c]|n[2*i+c]<<16}return a}function Es(r,e,t){const s=4*X(t),n=new Uint8Array(s*e),i=3*((t+1)**2-1);for(let o=0;o<i;o++)for(let a=0;a<e;a++)n[s*a+o]=r[e*o+a];return new Uint32Array(n.buffer)}const vs="cagesped",Ts=2,Z=16;async function Qe(r){const e=await C.open(new I(r),vs,Ts),{count:t,changed:s,packed:n,log_scales:i}=e.header,o=async f=>await e.read(f),a=async f=>await e.read(f),c=Ze(await o("hidden"),t),l=await e.read("sources"),h=n?Ke(await a("chunks"),await o("means"),s):await a("means"),d=n?qe(Ve(O(await o("rotations")),O(await o("scales")),i)):await a("covariances"),u=O(await o("opacities")),p=O(await o("turns")),m=await e.read("gains");return{count:t,hidden:c,changed:s,means:h,records:Je(l,h,d,u,p,m)}}function Ze(r,e){const t=new Uint8Array(e);for(let s=0;s<e;s++)t[s]=r[s>>3]>>(s&7)&1;return t}function Je(r,e,t,s,n,i){const o=r.length,a=new Uint32Array(Z*o),[c,l]=[new Uint32Array(e.buffer),new Uint32Array(t.buffer)];for(let h=0;h<o;h++){const d=Z*h;for(let u=0;u<3;u++)a[d+u]=c[3*h+u];a[d+3]=r[h];for(let u=0;u<6;u++)a[d+4+u]=l[6*h+u];a[d+10]=n[h]|n[o+h]<<16,a[d+11]=n[2*o+h]|s[h]<<16;for(let u=0;o*u<i.length;u++)a[d+12+u]=i[o*u+h]}return a}const Rs=1<<20;let bs=null;async function et(r){const e=r.byteLength>Rs?await(bs??=As()):null;if(e===null)return await Qe(r);const{port1:t,port2:s}=new MessageChannel,n=new Promise(o=>{t.onmessage=({data:a})=>o(a)});e.postMessage({file:r,answer:s},[r,s]);const i=await n;if(t.close(),"why"in i)throw new Error(i.why);return i.edits}function As(){return new Promise(r=>{const e=new ys;e.onmessage=()=>r(e),e.onerror=()=>r(null)})}function tt(r){const e=r.getExtension("EXT_color_buffer_float");return e&&r.getExtension("EXT_float_blend")?{color:r.RGBA16F,distance:r.R32F,isByte:!1}:e??r.getExtension("EXT_color_buffer_half_float")?{color:r.RGBA16F,distance:r.RGBA16F,isByte:!1}:{color:r.RGBA8,distance:r.RGBA8,isByte:!0}}class _s{constructor(e,t){this.gl=e,this.formats=t}textures=null;framebuffer=null;width=0;height=0;begin(e,t,s){const{gl:n,formats:i}=this;if(this.textures&&(e!==this.width||t!==this.height||s&&!this.textures.normal)&&this.dispose(),!this.textures){this.width=e,this.height=t,this.textures={color:this.texture(i.color),distance:this.texture(i.distance),normal:s?this.texture(i.color):null},this.framebuffer=n.createFramebuffer(),n.bindFramebuffer(n.FRAMEBUFFER,this.framebuffer);const{color:o,distance:a,normal:c}=this.textures;for(const[l,h]of[o,a,c].entries())h&&n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+l,n.TEXTURE_2D,h,0)}n.bindFramebuffer(n.FRAMEBUFFER,this.framebuffer),n.drawBuffers([n.COLOR_ATTACHMENT0,n.COLOR_ATTACHMENT1,...s?[n.COLOR_ATTACHMENT2]:[]]),n.viewport(0,0,e,t);for(let o=0;o<(s?3:2);o++)n.clearBufferfv(n.COLOR,o,[0,0,0,0])}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const s of Object.values(t))e.deleteTexture(s);e.deleteFramebuffer(this.framebuffer),this.forget()}texture(e){const{gl:t}=this,s=t.createTexture();return t.bindTexture(t.TEXTURE_2D,s),t.texStorage2D(t.TEXTURE_2D,1,e,this.width,this.height),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.NEAREST),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),s}}const he=65536;function Ss(r,e){const{means:t,hidden:s,changed:n}=r,[i,o,a]=e.axis,{offset:c,near:l}=e,h=t.length/3,d=h+(n?n.length/3:0),u=new Float32Array(d),p=new Uint32Array(u.buffer),m=new Uint32Array(d);let f=0;for(let w=0;w<h;w++){if(s!==null&&s[w]===1)continue;const T=i*t[3*w]+o*t[3*w+1]+a*t[3*w+2]+c;T<l||(u[f]=T,m[f++]=w)}if(n!==null)for(let w=h;w<d;w++){const T=3*(w-h),It=i*n[T]+o*n[T+1]+a*n[T+2]+c;It>=l&&(u[f]=It,m[f++]=w)}const y=new Uint32Array(he),x=new Uint32Array(f),g=new Uint32Array(f);for(let w=0;w<f;w++)y[p[w]&65535]++;let E=0;for(let w=he-1;w>=0;w--){const T=y[w];y[w]=E,E+=T}for(let w=f-1;w>=0;w--)x[y[p[w]&65535]++]=w;y.fill(0);for(let w=0;w<f;w++)y[p[w]>>>16]++;E=0;for(let w=he-1;w>=0;w--){const T=y[w];y[w]=E,E+=T}for(let w=0;w<f;w++){const T=x[w];g[y[p[T]>>>16]++]=m[T]}return g}const st=`(function(){"use strict";function R(s,l){const{means:f,hidden:w,changed:r}=s,[y,g,m]=l.axis,{offset:b,near:p}=l,i=f.length/3,A=i+(r?r.length/3:0),h=new Float32Array(A),a=new Uint32Array(h.buffer),d=new Uint32Array(A);let t=0;for(let n=0;n<i;n++){if(w!==null&&w[n]===1)continue;const e=y*f[3*n]+g*f[3*n+1]+m*f[3*n+2]+b;e<p||(h[t]=e,d[t++]=n)}if(r!==null)for(let n=i;n<A;n++){const e=3*(n-i),I=y*r[e]+g*r[e+1]+m*r[e+2]+b;I>=p&&(h[t]=I,d[t++]=n)}const o=new Uint32Array(65536),U=new Uint32Array(t),D=new Uint32Array(t);for(let n=0;n<t;n++)o[a[n]&65535]++;let c=0;for(let n=65535;n>=0;n--){const e=o[n];o[n]=c,c+=e}for(let n=t-1;n>=0;n--)U[o[a[n]&65535]++]=n;o.fill(0);for(let n=0;n<t;n++)o[a[n]>>>16]++;c=0;for(let n=65535;n>=0;n--){const e=o[n];o[n]=c,c+=e}for(let n=0;n<t;n++){const e=U[n];D[o[a[e]>>>16]++]=d[e]}return D}let u={means:new Float32Array(0),hidden:null,changed:null};self.onmessage=({data:s})=>{if(!("sort"in s)){u={...u,...s};return}const l=R(u,s.sort);self.postMessage(l,{transfer:[l.buffer]})}})();
`,rt=typeof self<"u"&&self.Blob&&new Blob([st],{type:"text/javascript;charset=utf-8"});function Os(r){let e;try{if(e=rt&&(self.URL||self.webkitURL).createObjectURL(rt),!e)throw"";const t=new Worker(e,{name:r?.name});return t.addEventListener("error",()=>{(self.URL||self.webkitURL).revokeObjectURL(e)}),t}catch{return new Worker("data:text/javascript;charset=utf-8,"+encodeURIComponent(st),{name:r?.name})}finally{e&&(self.URL||self.webkitURL).revokeObjectURL(e)}}const Ms=32768;class nt{onOrder=null;sortedHere=0;order=null;firstOrder=null;worker=null;hasNoWorker=!1;postedSet=null;running=null;preparing=null;next=null;outdated=!1;orderFor(e,t,s){this.firstOrder?.set===e&&(this.order=this.firstOrder,this.firstOrder=null);const{order:n}=this,i=n?.set===e?n:null;if(i!==null&&de(i.depths,t))return i;if(i===null||s||this.isQuick(e))return this.next=null,this.outdated=this.running!==null,this.sortedHere+=1,this.order={numbers:Ss(e,t),set:e,depths:t};const{running:o}=this,a=o?.set===e&&de(o.depths,t);return this.next=a?null:{set:e,depths:t,prepared:null},this.postNext(),i}prepare(e,t){return this.isQuick(e)?Promise.resolve():new Promise(s=>{this.preparing?.prepared?.(),this.preparing={set:e,depths:t,prepared:s},this.postNext()})}dispose(){this.worker?.terminate();const e=[this.running,this.preparing];this.worker=this.postedSet=this.running=this.preparing=this.next=this.firstOrder=this.order=null;for(const t of e)t?.prepared?.()}isQuick({means:e,changed:t}){return this.hasNoWorker||e.length+(t?.length??0)<=3*Ms}postNext(){const e=this.preparing??this.next;if(this.running!==null||e===null)return;e===this.preparing?this.preparing=null:this.next=null,this.running=e,this.worker??=this.startWorker();const{set:t,depths:s}=e,n=i=>this.worker?.postMessage(i);this.postedSet?.means!==t.means&&n({means:t.means}),this.postedSet!==t&&n({hidden:t.hidden,changed:t.changed}),this.postedSet=t,n({sort:s})}startWorker(){const e=new Os;return e.onmessage=({data:t})=>this.takeAnswer(t),e.onerror=()=>{this.hasNoWorker=!0,this.dispose(),this.onOrder?.()},e}takeAnswer(e){const{running:t,outdated:s}=this;if(this.running=null,this.outdated=!1,t===null)return;const n={numbers:e,set:t.set,depths:t.depths};t.prepared!==null?(this.firstOrder=n,t.prepared()):this.order?.set===t.set&&!s&&(this.order=n,this.onOrder?.()),this.postNext()}}function de(r,e){return r.offset===e.offset&&r.near===e.near&&r.axis.every((t,s)=>t===e.axis[s])}function ue({center:r},{c2w:e}){return[e[3]-r[0],e[7]-r[1],e[11]-r[2]]}function it(r,e){return Math.max(e,r.near)}function fe(r,e,t){const{c2w:s}=e,[n,i,o]=ue(r,e),a=[-s[2],-s[6],-s[10]];return{axis:a,offset:-(a[0]*n+a[1]*i+a[2]*o),near:it(r,t)}}function Us(r,e){const[t,s]=r.bounds;return Math.hypot(...ue(r,e))+Math.hypot(...s.map((n,i)=>n-t[i]))}const Ns=.02;function Ds(r,e){const{radius:t,distance:s}=at(r,e);return t/s*(ot(r,e)?1:Ns)}function ot(r,e){const{ray:t,radius:s}=at(r,e),{c2w:n}=e,i=a=>t.reduce((c,l,h)=>c+l*n[4*h+a],0),o=-i(2);return o>-s&&Math.abs(i(0))-s<=Math.max(o,s)*.5*e.width/e.fx&&Math.abs(i(1))-s<=Math.max(o,s)*.5*e.height/e.fy}function at({bounds:[r,e]},{c2w:t}){const s=r.map((o,a)=>.5*(e[a]-o)),n=r.map((o,a)=>o+s[a]-t[4*a+3]),i=Math.hypot(...s);return{ray:n,radius:i,distance:Math.max(Math.hypot(...n)-i,.1*i,1e-9)}}const Cs=.5;class ks{constructor(e,t,s){this.nodes=e;const n=[t];for(const o of e)n.push(n[n.length-1]+o.count);if(this.isComplete=n[e.length]<=s,this.states=e.map(()=>"coarse"),this.seen=e.map(()=>0),this.isComplete){this.free.push(...n.slice(0,-1)),e.forEach((o,a)=>this.places.set(o,n[a]));return}const i=Math.max(...e.map(o=>o.count));for(let o=t;o+i<=s;o+=i)this.free.push(o)}isComplete;states;seen;places=new Map;free=[];views=0;get resident(){return this.states.filter(e=>e==="loading"||e==="stored").length}look(e){this.views+=1,this.nodes.forEach((t,s)=>{ot(t,e)&&(this.seen[s]=this.views)})}next(e){const t=o=>e===null?-o:Ds(this.nodes[o],e),s=this.largest(o=>this.states[o]==="coarse",t);if(s===null)return null;const n=this.nodes[s];if(this.isComplete||this.resident<this.free.length+this.places.size)return this.states[s]="loading",{node:n,evicted:null};if(e===null||this.seen[s]!==this.views)return null;const i=this.victim(t(s),t);return i===null?null:(this.states[s]="loading",this.states[i]="evicted",{node:n,evicted:this.nodes[i]})}place(e){const t=this.places.get(e)??this.free.shift();if(t===void 0)throw new Error("no place for a node of splats");return this.places.set(e,t),t}store(e){this.states[this.nodes.indexOf(e)]="stored"}release(e){if(this.states[this.nodes.indexOf(e)]="coarse",this.isComplete)return;const t=this.places.get(e);this.places.delete(e),t!==void 0&&this.free.push(t)}coarseInImage(){return this.nodes.filter((e,t)=>this.states[t]==="coarse"&&this.seen[t]===this.views).length}victim(e,t){const s=this.largest(i=>this.states[i]==="stored"&&this.seen[i]!==this.views,i=>-this.seen[i]);if(s!==null)return s;const n=this.largest(i=>this.states[i]==="stored",i=>-t(i));return n!==null&&t(n)<Cs*e?n:null}largest(e,t){let s=null,n=-1/0;for(let i=0;i<this.nodes.length;i++)!e(i)||t(i)<=n||(s=i,n=t(i));return s}}const Ls=2;class Fs{constructor(e,t,s,n,i,o,a){this.store=e,this.nodes=t,this.open=s,this.apply=n,this.options=i,this.wanted=o,this.arrived=a;const c=t.reduce((l,h)=>Math.max(l,h.coarse[1]),0);this.residency=new ks(t,c,e.capacity)}residency;applying=Promise.resolve();isQueued=!1;storing=Promise.resolve();running=null;async load(e){const t=e();t!==null&&this.residency.look(t),this.running??=this.run(e).finally(()=>this.running=null),await this.running}look(e){const{residency:t}=this;t.look(e),!(t.isComplete||this.running!==null||t.coarseInImage()===0)&&this.load(()=>e).catch(s=>{this.options.onFailure?.(`details of the scene could not be loaded: ${String(s)}`)})}async run(e){const t=async()=>{for(let n=this.residency.next(e());n;n=this.residency.next(e())){if(!this.wanted())return;await this.loadNode(n.node,n.evicted)}};await Promise.all(Array.from({length:Ls},t)),await this.applied();const s=this.residency.coarseInImage();this.wanted()&&s>0&&this.options.onCoarse?.(s,this.nodes.length)}async loadNode(e,t){let s=0;const n=o=>{this.arrived+=o-s,s=o,this.options.onArrival?.(this.arrived)};let i=!1;try{for await(const o of Ye(await this.open(e.url),()=>{},n))this.storing=this.storing.then(async()=>{if(!this.wanted())return;const a=t;t=null,a!==null&&await this.evict(a),await this.store.storeNode(o,this.residency.place(e),e,this.wanted),this.residency.store(e)}),await this.storing,i=!0}finally{i||(this.residency.release(e),t!==null&&this.residency.store(t))}this.applied()}async evict(e){this.store.dropNode(e),await this.applied(),this.residency.release(e)}applied(){return this.isQueued?this.applying:(this.isQueued=!0,this.applying=this.applying.then(async()=>{this.isQueued=!1,await this.apply(),this.wanted()&&this.options.onDetails?.()}),this.applying)}}const v=2048,pe=3,Is=`
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
`,Bs=`
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
`,zs=`
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
`;function Ps(r){const e=X(r)/4,t=(r+1)**2,s=[...r>0?[`uniform float steps[${t-1}];`]:[],"vec3 colorOf(uint splat, vec3 d) {","  uvec2 last = texel(records, 2u * splat + 1u).zw;","  uint both = texel(records, 2u * splat).w;",`  vec3 rgb = 0.5 + ${re[0]} * colorStep * (vec3(both & 65535u, both >> 16, last.y >> 16) - 32768.0);`,...Array.from({length:e},(n,i)=>`  uvec4 t${i} = texel(harmonics, ${e}u * splat + ${i}u);`)];for(let n=1;n<t;n++){const i=[0,1,2].map(o=>{const a=3*(n-1)+o;return`(t${a>>4}.${"xyzw"[a>>2&3]} >> ${8*(a&3)} & 255u)`});s.push(`  rgb += (steps[${n-1}] * (${re[n]})) * (vec3(${i.join(", ")}) - 128.0);`)}return[...s,"  return rgb;","}"].join(`
`)}function Xs(r){return["#version 300 es","precision highp float;","precision highp int;","precision highp usampler2D;",...r.antialiased?["#define ANTIALIASED"]:[],...r.normals?["#define NORMALS"]:[],Is,r.normals?zs:"",Ps(r.degree),Bs].join(`
`)}const ct=ee(Ae),Gs=`#version 300 es
${ct}
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
}`,$s=`#version 300 es
${ct}
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
}`,Ws=`#version 300 es
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
`).join("")+r.slice(t)}class Hs{constructor(e){this.gl=e}order=null;outputs=[];framebuffer=null;rows=0;reserve(e,t){const{gl:s}=this,n=Math.ceil(e/v),i=pe+(t?1:0);if(n<=this.rows&&i<=this.outputs.length)return!1;const o=Math.max(i,this.outputs.length);this.rows=Math.max(n,this.rows),this.drop(),this.order=this.texture(s.R32UI),this.outputs=Array.from({length:o},()=>this.texture(s.RGBA32UI)),this.framebuffer=s.createFramebuffer(),s.bindFramebuffer(s.FRAMEBUFFER,this.framebuffer);for(const[a,c]of this.outputs.entries())s.framebufferTexture2D(s.FRAMEBUFFER,s.COLOR_ATTACHMENT0+a,s.TEXTURE_2D,c,0);return!0}put(e){const{gl:t}=this,s=Math.floor(e.length/v),n=e.length-s*v;N(t),t.bindTexture(t.TEXTURE_2D,this.order),t.texSubImage2D(t.TEXTURE_2D,0,0,0,v,s,t.RED_INTEGER,t.UNSIGNED_INT,e),n>0&&t.texSubImage2D(t.TEXTURE_2D,0,0,s,n,1,t.RED_INTEGER,t.UNSIGNED_INT,e,s*v),t.bindTexture(t.TEXTURE_2D,null)}bind(e,t){const{gl:s}=this;s.bindFramebuffer(s.FRAMEBUFFER,this.framebuffer),s.drawBuffers(this.outputs.map((n,i)=>i<pe||t?s.COLOR_ATTACHMENT0+i:s.NONE)),s.viewport(0,0,v,Math.ceil(e/v))}dispose(){this.drop(),this.rows=0}drop(){const{gl:e}=this;for(const t of[this.order,...this.outputs])e.deleteTexture(t);e.deleteFramebuffer(this.framebuffer),this.order=this.framebuffer=null,this.outputs=[]}texture(e){const{gl:t}=this,s=t.createTexture();return t.bindTexture(t.TEXTURE_2D,s),t.texStorage2D(t.TEXTURE_2D,1,e,v,this.rows),Y(t,t.TEXTURE_2D,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),s}}const lt=.3;class ht{constructor(e,t,s){this.gl=e,this.targets=t,this.blendTarget=new _s(e,s),this.projection=new Hs(e),this.vertices=e.createVertexArray()}compileTime=0;compiled=0;programs=new Map;blendTarget;projection;vertices;uploadedOrder=null;draw(e){const{gl:t,blendTarget:s}=this,{store:n,camera:i,normals:o,rows:a,columns:c}=e,l=this.project(e);s.begin(this.targets.width,this.targets.height,o),t.enable(t.SCISSOR_TEST),t.scissor(c.first,a.first,c.count,a.count);const h=s.formats.isByte?1/Us(n.header,i):1;l>0&&this.blend(l,o,h),this.resolve(o,h,e.background),t.disable(t.SCISSOR_TEST)}bindVertices(){this.gl.bindVertexArray(this.vertices)}dispose(){const{gl:e}=this;this.uploadedOrder=null,this.blendTarget.dispose(),this.projection.dispose();for(const{program:t}of this.programs.values())e.deleteProgram(t);this.programs.clear(),e.deleteVertexArray(this.vertices)}project({store:e,changed:t,camera:s,near:n,order:i,normals:o}){const{gl:a}=this,{degree:c,antialiased:l,steps:h,log_scales:d,color_step:u}=e.header,p=i.numbers.length;if(p===0)return 0;const{program:m,uniform:f}=this.programFor(`project${c}${l}${o}`,()=>L(a,W,Xs({degree:c,antialiased:l,normals:o}))),{projection:y}=this;return(y.reserve(p,o)||this.uploadedOrder!==i)&&y.put(i.numbers),this.uploadedOrder=i,y.bind(p,o),a.useProgram(m),this.bindVertices(),this.setView(f,e,s,n),c>0&&a.uniform1fv(f("steps"),h),a.uniform1ui(f("own"),e.count),a.uniform1f(f("logLow"),d[0]),a.uniform1f(f("logStep"),(d[1]-d[0])/65535),a.uniform1f(f("colorStep"),u),a.uniform1ui(f("count"),p),this.bind(f,"order",y.order,0),this.bind(f,"records",e.records.texture,1),this.bind(f,"harmonics",e.harmonics.texture,2),this.bind(f,"changed",(t??e.records).texture,3),a.drawArrays(a.TRIANGLES,0,3),p}blend(e,t,s){const{gl:n}=this,i=t?["NORMALS"]:[],{program:o,uniform:a}=this.programFor(`blend${t}`,()=>L(n,me(Gs,i),me($s,i)));n.useProgram(o),this.bindVertices(),["places","shapes","tints",...t?["normals"]:[]].forEach((l,h)=>this.bind(a,l,this.projection.outputs[h],h)),n.uniform2f(a("size"),this.targets.width,this.targets.height),n.uniform1f(a("unit"),s),n.enable(n.BLEND),n.blendEquation(n.FUNC_ADD),n.blendFunc(n.ONE,n.ONE_MINUS_SRC_ALPHA),n.drawArrays(n.TRIANGLES,0,6*e),n.disable(n.BLEND)}resolve(e,t,s){const{gl:n}=this,{program:i,uniform:o}=this.programFor(`resolve${e}`,()=>L(n,W,me(Ws,e?["NORMALS"]:[])));this.targets.bind(e),n.useProgram(i),this.bindVertices();const{color:a,distance:c,normal:l}=this.blendTarget.textures;this.bind(o,"gathered",a,0),this.bind(o,"distances",c,1),l&&e&&this.bind(o,"axes",l,2),n.uniform3f(o("background"),...s),n.uniform1f(o("unit"),t),n.drawArrays(n.TRIANGLES,0,3)}bind(e,t,s,n){const{gl:i}=this;i.activeTexture(i.TEXTURE0+n),i.bindTexture(i.TEXTURE_2D,s),i.uniform1i(e(t),n)}setView(e,{header:t},s,n){const{gl:i}=this,{width:o,height:a}=this.targets,{c2w:c}=s,[l,h]=[s.fx,s.cx].map(y=>y*o/s.width),[d,u]=[s.fy,s.cy].map(y=>y*a/s.height),[p,m]=[.5*lt*o/l,.5*lt*a/d];i.uniform3f(e("eye"),...ue(t,s));const f=[c[0],-c[1],-c[2],c[4],-c[5],-c[6],c[8],-c[9],-c[10]];i.uniformMatrix3fv(e("W"),!1,f),i.uniform2f(e("focal"),l,d),i.uniform2f(e("center"),h,u),i.uniform2f(e("size"),o,a),i.uniform4f(e("limits"),-h/l-p,(o-h)/l+p,-u/d-m,(a-u)/d+m),i.uniform1f(e("near"),it(t,n))}programFor(e,t){let s=this.programs.get(e);return s||(s=t(),this.programs.set(e,s),this.compileTime=s.milliseconds,this.compiled+=1),s}}const dt=128;class H{constructor(e,t){this.gl=e,this.rows=Math.max(1,Math.ceil(t/(4*v)));const s=te(e,e.MAX_TEXTURE_SIZE);if(this.rows>s)throw new B(`the splats take ${this.rows} rows of a texture, more than the ${s} that the GPU has`);for(;e.getError()!==e.NO_ERROR;);if(this.texture=e.createTexture(),e.bindTexture(e.TEXTURE_2D,this.texture),e.texStorage2D(e.TEXTURE_2D,1,e.RGBA32UI,v,this.rows),Y(e,e.TEXTURE_2D,e.NEAREST),e.bindTexture(e.TEXTURE_2D,null),e.getError()===e.OUT_OF_MEMORY)throw this.dispose(),new Error("the GPU has not enough memory for the splats")}texture;rows;stride=4*v;async uploadRange(e,t,s,n){const{stride:i}=this;for(let o=Math.floor(t/i);o*i<s;o+=dt){if(o*i>t&&await new Promise(a=>setTimeout(a)),!n())return;this.uploadRows(e,o,Math.min(o+dt,Math.ceil(s/i)))}}uploadRows(e,t,s){const{gl:n,stride:i}=this;let o=e.subarray(t*i,s*i);if(o.length<(s-t)*i){const a=new Uint32Array((s-t)*i);a.set(o),o=a}N(n),n.bindTexture(n.TEXTURE_2D,this.texture),n.texSubImage2D(n.TEXTURE_2D,0,0,t,v,s-t,n.RGBA_INTEGER,n.UNSIGNED_INT,o),n.bindTexture(n.TEXTURE_2D,null)}dispose(){this.gl.deleteTexture(this.texture)}}const ut=16*(pe+1)+4;class Vs{constructor(e,t,s){this.gl=e,this.header=t;const{degree:n}=t,i=X(n),o=4*(S+i)+ut,a=Math.min(Math.floor(s/o),t.budget??1/0),c=t.nodes?Math.min(t.count,a):t.count;if(this.capacity=c,this.bytes=o*c,this.bytes>s)throw new B(`the splats take ${Math.ceil(this.bytes/2**20)} MiB of the GPU, more than the ${Math.floor(s/2**20)} allowed`);this.means=new Float32Array(3*c),this.words=new Uint32Array(S*c),this.harmonicWords=new Uint32Array(i*c),this.set={means:this.means.subarray(0,0),hidden:null,changed:null},this.records=new H(e,this.words.length),this.harmonics=new H(e,this.harmonicWords.length)}set;records;harmonics;bytes;capacity;stored=0;hidden=null;places=new Map;isOutdated=!1;means;words;harmonicWords;get count(){return this.set.means.length/3}get isWhole(){return this.count===this.header.count}async take(e,t){this.means.set(e.means,3*e.first),this.words.set(e.records,S*e.first),this.harmonicWords.set(e.harmonics,X(e.header.degree)*e.first),await this.upload(e.first,e.first+e.count,t)}async storeNode(e,t,s,n){const i=X(e.header.degree);this.means.set(e.means,3*t),this.words.set(e.records,S*t),this.harmonicWords.set(e.harmonics,i*t);const o=t+e.count;await this.records.uploadRange(this.words,S*t,S*o,n),await this.harmonics.uploadRange(this.harmonicWords,i*t,i*o,n),this.stored=Math.max(this.stored,o),this.places.set(s,[t,o]),this.isOutdated=!0}dropNode(e){this.isOutdated=this.places.delete(e)||this.isOutdated}setWithNodes(){if(!this.isOutdated)return null;this.isOutdated=!1;const e=new Uint8Array(this.stored);e.fill(1,this.header.levels[this.header.levels.length-1]);for(const[t,[s,n]]of this.places)e.fill(1,...t.coarse),e.fill(0,s,n);return this.hidden=e,{means:this.means.subarray(0,3*this.stored),hidden:e,changed:null}}async restore(e){const{count:t}=this;this.records=new H(this.gl,this.words.length),this.harmonics=new H(this.gl,this.harmonicWords.length),this.set={...this.set,means:this.means.subarray(0,0)},await this.upload(0,t,e)}dispose(){this.records.dispose(),this.harmonics.dispose()}async upload(e,t,s){const n=X(this.header.degree);await this.records.uploadRange(this.words,S*e,S*t,s),s()&&await this.harmonics.uploadRange(this.harmonicWords,n*e,n*t,s),s()&&(this.stored=Math.max(this.stored,t),this.set={means:this.means.subarray(0,3*t),hidden:this.hidden?.slice(0,t)??null,changed:null})}}const qs=768*2**20;class ft{constructor(e,t=qs,s=null){this.gl=e,this.memory=t,this.targets=new Pe(e),this.viewPasses=new Xe(e,this.targets),this.passes=new ht(e,this.targets,s??tt(e))}background=[1,1,1];near=0;edited=!0;targets;inBands=!1;inOrder=!0;level=null;uploaded={last:0,total:0};viewPasses;sorters={before:new nt,after:new nt};passes;store=null;loader=null;changed=null;prepared=null;camera=null;loading=0;set onOrder(e){for(const t of Object.values(this.sorters))t.onOrder=e}get editable(){return this.count>0}get count(){return this.store?.count??0}get bytes(){return this.store?.bytes??0}get compileTime(){return this.passes.compileTime}get compiled(){return this.passes.compiled}get sortedHere(){return this.sorters.before.sortedHere+this.sorters.after.sortedHere}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e,this.loader?.look(e)}async load(e,t={}){const s=++this.loading;this.loader=null;const n=()=>s===this.loading;let i=0,o=null,a=0;const c=l=>{n()&&(o=new Vs(this.gl,l,this.memory))};try{const l=d=>{a=d,t.onArrival?.(d)};for await(const d of Ye(e,c,l)){const u=o;if(!n()||u===null||(await u.take(d,n),!n()))return;this.store!==u&&(this.store?.dispose(),this.store=u),this.level={field:{background:d.header.background},last:d.last},t.onLevel?.(++i,d.header.levels.length)}const h=o;h?.header.nodes&&t.openBeside&&await this.loadNodes(h,h.header.nodes,t.openBeside,a,t,n)}finally{const l=o;l!==null&&this.store!==l&&l.dispose()}}async loadNodes(e,t,s,n,i,o){const a=()=>this.applyNodes(e,o),c=new Fs(e,t,s,a,i,o,n);await c.load(()=>this.camera),o()&&(this.loader=c,this.level={field:{background:e.header.background},last:!0},i.onLevel?.(2,2))}async applyNodes(e,t){const s=e.setWithNodes();if(s===null)return;const{camera:n}=this;n!==null&&await this.sorters.before.prepare(s,fe(e.header,n,this.near)),t()&&(e.set=s)}async restore(){const{gl:e,store:t,changed:s}=this;this.changed=null,this.targets.forget(),this.viewPasses.forget(),this.passes=new ht(e,this.targets,tt(e));const n=++this.loading,{loader:i}=this,o=()=>n===this.loading;this.loader=null,await t?.restore(o),i!==null&&o()&&(i.wanted=o,this.loader=i),this.setEdits(s?.edits??null)}async readEdits(e){return await et(e)}async prepare(e){const{store:t,camera:s}=this;if(t===null||s===null||!this.edited||e.changed===0||e.count!==t.header.count)return;const n=mt(e,t);this.prepared={edits:e,set:n,own:t.set},await this.sorters.after.prepare(n,fe(t.header,s,this.near))}setEdits(e){const{prepared:t}=this;if(this.changed?.texture.dispose(),this.changed=this.prepared=null,this.uploaded.last=0,e===null||e.changed===0&&!e.hidden.includes(1))return;if(this.store!==null&&e.count!==this.store.header.count)throw new Error(`edits of ${e.count} splats, the page has ${this.store.header.count}; reload it`);const s=this.bytes+(4*Z+ut)*e.changed;if(s>this.memory)throw new B(`the edited splats take ${pt(s)} MiB of the GPU, more than the ${pt(this.memory)} allowed`);const n=new H(this.gl,e.records.length);e.changed>0&&n.uploadRows(e.records,0,Math.ceil(e.records.length/n.stride));const{set:i,own:o}=t?.edits===e?t:{set:null,own:null};this.changed={edits:e,texture:n,set:i,own:o},this.uploaded.last=e.changed>0?e.records.byteLength:0,this.uploaded.total+=this.uploaded.last}render(e={}){const{gl:t,store:s,camera:n,background:i,near:o}=this;if(!s||s.count===0||!n||t.isContextLost())return!1;const{width:a,height:c}=this.targets,l=this.shownSet(s),h=fe(s.header,n,o),u=(l===s.set?this.sorters.before:this.sorters.after).orderFor(l,h,e.sorted??!1);this.inOrder=de(u.depths,h),z(t);const p=e.rows??{first:0,count:c},m=e.columns??{first:0,count:a},f=this.changed?.texture??null;return this.passes.draw({store:s,changed:f,camera:n,near:o,order:u,normals:e.normals??!1,background:i,rows:p,columns:m}),P(t),!0}show(e,t,s=null,n="color"){const{gl:i}=this;i.bindFramebuffer(i.FRAMEBUFFER,s),this.passes.bindVertices(),z(i),this.viewPasses.show(n,this.reach,e,t),P(i)}read(e=!1){return this.targets.read(e)}distances(e){this.passes.bindVertices(),z(this.gl);const t=this.viewPasses.distances(e);return P(this.gl),t}wait(){this.targets.wait()}dispose(){this.loading++,this.setEdits(null),this.store?.dispose(),this.store=this.level=null;for(const e of Object.values(this.sorters))e.dispose();this.viewPasses.dispose(),this.targets.dispose(),this.passes.dispose()}shownSet(e){const{changed:t}=this;return!this.edited||t===null?e.set:((t.set===null||t.own!==e.set)&&(t.own=e.set,t.set=mt(t.edits,e)),t.set)}get reach(){const{store:e,camera:t}=this;return!e||!t?[0,1]:Oe(e.header.bounds,t)}}const pt=r=>Math.ceil(r/2**20);function mt(r,e){return{means:e.set.means,hidden:r.hidden,changed:js(r,e)}}function js({means:r,records:e,changed:t},s){if(s.isWhole)return r;const n=Float32Array.from(r);for(let i=0;i<t;i++)e[Z*i+3]>=s.count&&(n[3*i]=NaN);return n}const R=(r,e,t=1)=>[r[0]+t*e[0],r[1]+t*e[1],r[2]+t*e[2]],b=(r,e)=>R(r,e,-1),V=(r,e)=>[e*r[0],e*r[1],e*r[2]],M=(r,e)=>r[0]*e[0]+r[1]*e[1]+r[2]*e[2],G=(r,e)=>[r[1]*e[2]-r[2]*e[1],r[2]*e[0]-r[0]*e[2],r[0]*e[1]-r[1]*e[0]],k=r=>Math.hypot(...r),D=r=>V(r,1/Math.max(1e-30,k(r)));function ye(r,e,t){const[s,n]=[Math.cos(t),Math.sin(t)];return R(R(V(r,s),G(e,r),n),e,M(e,r)*(1-s))}const U=(r,e)=>[r[e],r[4+e],r[8+e]];function yt(r,e,t,s){return[0,1,2].flatMap(n=>[r[n],e[n],t[n],s[n]]).concat(0,0,0,1)}const Ys=.02,Ks=.01;function Qs(r,e){const{c2w:t,eye:s}=r.orbit,{clientWidth:n,clientHeight:i}=r.canvas,o=b(e,s),a=-M(o,U(t,2));if(a<=0)return{x:0,y:0,seen:!1};const c=.5*n+r.focal*M(o,U(t,0))/a,l=.5*i-r.focal*M(o,U(t,1))/a;if(c<0||l<0||c>=n||l>=i)return{x:c,y:l,seen:!1};const h=k(o),d=Ys*h+Ks*r.extent;return{x:c,y:l,seen:Zs(r.distances,c/n,l/i)>=h-d}}function Zs(r,e,t){if(r===null)return 1/0;const{width:s,height:n,values:i}=r;return i[Math.floor(t*n)*s+Math.floor(e*s)]}class Js{constructor(e,t,s,n){this.host=e,this.hotspots=t,this.card=n,this.marks=t.map((i,o)=>{const a=document.createElement("button");return a.textContent=String(o+1),a.title=i.title,a.hidden=!0,a.onclick=()=>this.open(o),a}),s.replaceChildren(...this.marks)}shown=null;marks;card;open(e){const t=this.hotspots[e];this.shown=e,this.part("h2").textContent=t.title,this.part("p").textContent=t.text,this.part(".count").textContent=`${e+1} / ${this.hotspots.length}`,this.card.hidden=!1,this.marks.forEach((s,n)=>s.classList.toggle("on",n===e)),this.host.flyTo(t.view,t.position)}step(e){const t=this.hotspots.length;if(t===0)return;const s=e>0?-1:t;this.open(((this.shown??s)+e+t)%t)}close(){this.shown=null,this.card.hidden=!0;for(const e of this.marks)e.classList.remove("on")}arrange(){this.marks.forEach((e,t)=>{const s=this.host.place(this.hotspots[t]);if(e.hidden=!0,s===null)return;const{x:n,y:i,seen:o}=Qs(this.host,s);e.hidden=!o,o&&(e.style.transform=`translate(${n}px, ${i}px)`)})}part(e){const t=this.card.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}}const er=140,we=[["km",1e3],["m",1],["cm",.01],["mm",.001]];function tr(r){const e=er*r,t=10**Math.floor(Math.log10(e)),s=t*(e/t>=5?5:e/t>=2?2:1),[n,i]=we.find(([,o])=>s>=o*(1-1e-9))??we[we.length-1];return{label:`${Number((s/i).toPrecision(6))} ${n}`,pixels:s/r}}function sr(r,e,t,s){const n=k(b(e.eye,e.target)),{label:i,pixels:o}=tr(s*n/t);r.style.width=`${o}px`,r.textContent=i,r.hidden=!1}const wt=new Map;function xt(r){let e=wt.get(r);if(!e){let t;const s=new ReadableStream({start:n=>void(t=n)});if(!t)throw new Error("a stream without a controller");wt.set(r,e={stream:s,controller:t})}return e}function rr(r,e){document.currentScript?.remove();const{controller:t}=xt(r);try{e===null?t.close():t.enqueue(nr(e))}catch{}}function nr(r){const e=atob(r),t=new Uint8Array(e.length);for(let s=0;s<e.length;s++)t[s]=e.charCodeAt(s);return t}async function xe(r,{url:e}){return e===void 0?xt(r).stream:await gt(e)}async function gt(r){if(location.protocol==="file:")throw new Error("A browser does not let a page read files beside it on a disk: serve the folder (python -m http.server), or export a single .html file.");const e=await fetch(r);if(!e.ok||e.body===null)throw new Error(`${r} cannot be loaded (${e.status}); reload the page.`);return e.body}async function Et(r){return await new Response(r).arrayBuffer()}const ge=[1,.75,.5,.35,.25,.18,.12],ir=.25,or=16,ar=4,cr=.3;class lr{constructor(e=28,t=40){this.frameBudget=e,this.bandBudget=t}cost=null;record(e,t){const s=t/Math.max(1,e);this.cost=this.cost===null?s:this.cost+cr*(s-this.cost)}scale(e,t){const{cost:s}=this;if(s===null)return ir;const n=i=>s*e*t*i*i<=this.frameBudget;return ge.find(n)??ge[ge.length-1]}bandRows(e,t){if(this.cost===null)return or;const s=Math.floor(this.bandBudget/Math.max(1e-9,this.cost*e));return Math.max(ar,Math.min(t,s))}}async function hr(r){const e=performance.now(),t=r.fenceSync(r.SYNC_GPU_COMMANDS_COMPLETE,0);if(r.flush(),t===null)return 0;for(;!r.isContextLost()&&r.clientWaitSync(t,0,0)===r.TIMEOUT_EXPIRED;)await new Promise(s=>setTimeout(s,1));return r.deleteSync(t),performance.now()-e}const vt=8;function dr(r,e,t){return r==="splats"?new ft(e,t):new Ge(e,t)}function Tt(r){return String.fromCharCode(...r.subarray(0,vt))}async function ur(r){const e=r.getReader(),t=[];let s=0;for(;s<vt;){const{value:a,done:c}=await e.read();if(c)break;t.push(a),s+=a.length}const n=new Uint8Array(s);let i=0;for(const a of t)n.set(a,i),i+=a.length;const o=new ReadableStream({start:a=>a.enqueue(n),pull:async a=>{const{value:c,done:l}=await e.read();l?a.close():a.enqueue(c)},cancel:async a=>await e.cancel(a)});return{kind:Tt(n)===je?"splats":"voxels",source:o}}function Rt({stills:r,seconds:e,loop:t},s){const n=e>0?s/e:1,i=r.length-1,o=t?n%1*r.length:Math.min(n,1)*i,a=Math.min(Math.floor(o),i),c=t?(Math.floor(o)+1)%r.length:Math.min(Math.floor(o)+1,i);return{one:a,other:c,share:o-Math.floor(o)}}function fr(r,e,t){const{one:s,other:n,share:i}=Rt(e,t),o=r[s],a=r[n];return o===null||a===null?null:R(o,b(a,o),i)}function pr(r,e){const t=Rt(r,e),s=r.stills[t.one],n=r.stills[t.other],i=t.share,o=h=>R(U(s.c2w,h),b(U(n.c2w,h),U(s.c2w,h)),i),a=D(o(2)),c=o(1),l=D(b(c,[a[0]*M(c,a),a[1]*M(c,a),a[2]*M(c,a)]));return{c2w:yt(G(l,a),l,a,o(3)),fov_y_deg:s.fov_y_deg+i*(n.fov_y_deg-s.fov_y_deg)}}function bt(r,e){const t=r.length-1;let s=0;for(;s<t-1&&r[s+1]<=e;)s++;const n=(e-r[s])/Math.max(1e-9,r[s+1]-r[s]);return{first:s,share:Math.max(0,Math.min(1,n))}}function mr(r,e,t,s){const n=t*t*(3-2*t),i=R(r.target,b(e.target,r.target),n),[o,a]=[r,e].map(({eye:h,target:d})=>b(h,d)),c=k(o)**(1-n)*k(a)**n,l=yr(D(o),D(a),n,s);return{eye:R(i,V(l,c)),target:i,fov_y_deg:r.fov_y_deg+n*(e.fov_y_deg-r.fov_y_deg)}}function yr(r,e,t,s){const n=Math.acos(Math.max(-1,Math.min(1,M(r,e))));if(n<1e-9)return e;const i=G(r,e);return ye(r,D(k(i)>1e-9?i:s),t*n)}const At=.02;class Ee{constructor(e,t,s){this.up=t,this.eye=U(e,3);const n=V(U(e,2),-1);this.target=R(this.eye,n,Math.max(M(b(s,this.eye),n),.001))}eye;target;get c2w(){const e=D(b(this.eye,this.target)),t=D(G(this.up,e));return yt(t,G(e,t),e,this.eye)}turn(e,t){const s=ye(b(this.eye,this.target),this.up,-e),n=D(G(this.up,s)),i=Math.acos(Math.max(-1,Math.min(1,M(D(s),this.up)))),o=Math.max(At,Math.min(Math.PI-At,i-t))-i;this.eye=R(this.target,ye(s,n,o))}shift(e,t,s){const n=2*s*k(b(this.eye,this.target)),{c2w:i}=this,o=R(V(U(i,0),-e*n),U(i,1),t*n);this.eye=R(this.eye,o),this.target=R(this.target,o)}zoom(e){this.eye=R(this.target,b(this.eye,this.target),e)}}const _t=65536;let q=null;function wr(){if(q)return q;q=new Float32Array(_t);for(let r=0;r<_t;r++){const e=r>>10&31,t=r&1023,s=e===0?t*2**-24:(1+t/1024)*2**(e-15);q[r]=r&32768?-s:s}return q}const St=new Float32Array(1),Ot=new Uint32Array(St.buffer);function xr(r){St[0]=r;const e=Ot[0]>>>16&32768,t=Ot[0]&2147483647;return t>=947912704?e|t-939524096+4095+(t>>>13&1)>>>13:e|Math.round(Math.abs(r)*2**24)}function gr(r,e,t){const s=wr(),n=new Uint16Array(r.length);for(let i=0;i<n.length;i++){const o=s[r[i]];n[i]=xr(o+t*(s[e[i]]-o))}return n}const{BOX_ROWS:Er,BOX_VECTOR:vr,EDIT_ROWS:J,GRADE_SCALARS:Tr,HEXAHEDRON:ve,HEXAHEDRON_ROWS:Mt,Y_BOX_VECTOR:Ut}=A,Rr=[vr,ve+Ut,ve+Mt+Ut];class Te{constructor(e,t,s,n,i){this.header=e,this.times=t,this.order=s,this.occupancy=n,this.states=i}static async read(e){const t=await C.open(new I(e),"cagepath",2),{header:s}=t,n=await t.read("times"),i=await t.read("states"),o=await t.read("occupancy"),a=[],c=[];for(const u of s.edits.keys())a.push(await t.read(`rows.${u}`));for(let u=0;u<s.stored;u++)c.push({key:`${u}`,halves:se(await t.read(`lattice.${u}`))});const l=[];for(const[u,p]of s.layer_keys.entries())l.push(await Ne(t,`layer.${u}`,p));const h=s.edits.map((u,p)=>{const m=s.layers[p].map(([f,y,x,g])=>({layer:l[f],place:y,first:x,end:g}));return{edits:u,boxes:s.boxes[p],rows:a[p],lattices:s.lattices[p].map(f=>c[f]),layers:m}}),d={key:"path",origin:s.origin,dims:s.dims,codes:o,changed:null};return new Te(s,n,i,d,h)}at(e){const{order:t,states:s}=this,{first:n,share:i}=bt(this.times,e),o=s[t[n]],a=s[t[n+1]],c=i<.5?o:a;if(o===a||!br(o,a))return this.edits(c,c.rows,c.lattices);const l=o.lattices.map((h,d)=>h===a.lattices[d]?h:{key:`${h.key} ${a.lattices[d].key} ${i}`,halves:gr(h.halves,a.lattices[d].halves,i)});return this.edits(o,_r(o,a,i),l)}edits({edits:e,boxes:t,layers:s},n,i){return{edits:e,boxes:t,preserveOpacity:this.header.preserve_opacity,rows:n,lattices:i,layers:s,occupancy:this.occupancy}}}function br(r,e){if(r.edits!==e.edits||r.boxes!==e.boxes)return!1;for(let t=0;4*t<r.rows.length;t++)if(r.rows[4*t+3]!==e.rows[4*t+3]&&!(t<r.edits*J&&Ar(t%J)))return!1;return!0}function Ar(r){return r>=Tr&&r!==ve+Mt}function _r({edits:r,boxes:e,rows:t},{rows:s},n){const i=t.map((a,c)=>a+n*(s[c]-a)),o=a=>{for(let c=4*a;c<4*a+3;c++)i[c]=Math.min(t[c],s[c]);for(let c=4*a+4;c<4*a+7;c++)i[c]=Math.max(t[c],s[c])};for(let a=0;a<r;a++)for(const c of Rr)o(a*J+c);for(let a=0;a<e;a++)o(r*J+Er*a);return i}const Nt="cagesppa";class Sr{constructor(e,t,s){this.rotations=e,this.scales=t,this.logs=s}made=null;get axes(){return this.made??=Ve(this.rotations,this.scales,this.logs)}}class Re{constructor(e,t,s,n){this.header=e,this.times=t,this.order=s,this.states=n}geometry=new Map;static async read(e){const t=await C.open(new I(e),Nt,2),{header:s}=t,n=await t.read("times"),i=await t.read("states"),o=new Map,a=new Map,c=(d,u)=>o.get(`${d}.${s[d][u]}`),l=(d,u)=>O(c(d,u)),h=[];for(const d of s.changed.keys()){for(const m of["hidden","sources","rotations","scales","opacities","gains"]){const f=`${m}.${s[m][d]}`;o.has(f)||o.set(f,await t.read(f))}const u=`${s.rotations[d]} ${s.scales[d]}`;a.has(u)||a.set(u,new Sr(l("rotations",d),l("scales",d),s.log_scales));const p=s.after[d]<0?null:h[s.after[d]].moves;h.push({hidden:c("hidden",d),sources:c("sources",d),shapes:a.get(u),opacities:l("opacities",d),gains:c("gains",d),moves:Mr(O(await t.read(`moves.${d}`)),p)})}return new Re(s,n,i,h)}at(e){const{order:t,states:s,header:n}=this,{first:i,share:o}=bt(this.times,e),[a,c]=[t[i],t[i+1]],l=o<.5?a:c;if((a===c||o===0||o===1)&&l===n.whole)return null;const h=s[l];let{means:d,covariances:u}=this.geometryOf(h);if(a!==c){const f=s[l===a?c:a],y=l===a?o:1-o,x=Or(h.sources,f.sources),g=this.geometryOf(f);d=Dt(d,g.means,x,3,y),u=Dt(u,g.covariances,x,6,y)}const p=h.sources.length,m=Je(h.sources,d,u,h.opacities,h.moves.subarray(3*p,6*p),h.gains);return{count:n.count,hidden:Ze(h.hidden,n.count),changed:p,means:d,records:m}}geometryOf(e){let t=this.geometry.get(e);if(!t){t=Ur(e,this.header);for(const s of this.geometry.keys())this.geometry.size>1&&this.geometry.delete(s);this.geometry.set(e,t)}return t}}function Or(r,e){const t=new Int32Array(r.length).fill(-1);let s=0;for(let n=0;n<r.length;n++){for(;s<e.length&&e[s]<r[n];)s++;s<e.length&&e[s]===r[n]&&(t[n]=s++)}return t}function Dt(r,e,t,s,n){const i=Float32Array.from(r);for(let o=0;o<t.length;o++)if(!(t[o]<0))for(let a=0;a<s;a++)i[s*o+a]+=n*(e[s*t[o]+a]-i[s*o+a]);return i}function Mr(r,e){for(let t=0;t<r.length;t++)r[t]=(e===null?0:e[t])+(r[t]>>>1^-(r[t]&1));return r}function Ur({moves:r,shapes:e},{low:t,step:s,stretch:n}){const i=r.length/12,o=new Float32Array(3*i),{axes:a}=e,c=new Float32Array(9*i);for(let l=0;l<i;l++){const h=E=>r[E*i+l];for(let E=0;E<3;E++)o[3*l+E]=t[E]+s*h(E);const d=He(h(3),h(4),h(5)),[u,p,m,f,y,x]=[6,7,8,9,10,11].map(E=>n*(h(E)-32768)),g=[1+u,p,m,p,1+f,y,m,y,1+x];Ct(c,9*l,Ct([],0,d,0,g,0),0,a,9*l)}return{means:o,covariances:qe(c)}}function Ct(r,e,t,s,n,i){for(let o=0;o<3;o++)for(let a=0;a<3;a++){let c=0;for(let l=0;l<3;l++)c+=t[s+3*o+l]*n[i+3*l+a];r[e+3*o+a]=c}return r}const Nr=.0012,Dr=30,kt=(r,e)=>Math.hypot(r.x-e.x,r.y-e.y);function Cr(r,e){if(r.length===0)return;const t=r.slice(0,2),s=l=>t.reduce((h,{position:d,applied:u})=>h+d[l]-u[l],0)/t.length,[n,i]=[s("x"),s("y")],o=n!==0||i!==0,[a,c]=t;if(t.length===2){o&&e.shift(n,i);const l=kt(a.applied,c.applied),h=kt(a.position,c.position);l>1&&h>1&&l!==h&&e.zoom(l/h)}else o&&a.shifts?e.shift(n,i):o&&e.turn(n,i);for(const l of r)l.applied=l.position}function kr(r,e){const t=new Map,s=()=>Cr([...t.values()],e);let n=!1;r.style.touchAction="none",r.addEventListener("contextmenu",i=>i.preventDefault()),r.addEventListener("pointerdown",i=>{r.setPointerCapture(i.pointerId),s();const o={x:i.clientX,y:i.clientY},a=i.button!==0||i.shiftKey;t.set(i.pointerId,{position:o,applied:o,shifts:a})});for(const i of["pointerup","pointercancel"])r.addEventListener(i,o=>{s(),t.delete(o.pointerId)});r.addEventListener("pointermove",i=>{const o=t.get(i.pointerId);o&&(o.position={x:i.clientX,y:i.clientY},!n&&(n=!0,requestAnimationFrame(()=>{n=!1,s()})))}),r.addEventListener("wheel",i=>{i.preventDefault();const o=i.deltaMode===WheelEvent.DOM_DELTA_LINE?Dr:1;e.zoom(Math.exp(Nr*o*i.deltaY))},{passive:!1})}const Lt=120,Lr=2,Fr=8,Ir=1e4,Br=2500;class zr{constructor(e,t,s,n=()=>{}){this.canvas=e,this.header=t,this.say=s,this.progressed=n;const i=e.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,powerPreference:"high-performance"});if(!i)throw new Error("This browser has no WebGL2, which the scene needs.");this.gl=i,this.orbit=new Ee(t.start.c2w,t.up,t.center),this.fov=t.start.fov_y_deg,kr(e,{turn:(o,a)=>this.change(()=>this.orbit.turn(Math.PI*o/e.clientHeight,Math.PI*a/e.clientHeight)),shift:(o,a)=>this.change(()=>this.orbit.shift(o/e.clientHeight,a/e.clientHeight,this.halfTangent)),zoom:o=>this.change(()=>this.orbit.zoom(o))}),e.addEventListener("webglcontextlost",o=>o.preventDefault()),e.addEventListener("webglcontextrestored",()=>{this.renderer?.restore().then(()=>this.invalidate())}),new ResizeObserver(()=>this.invalidate()).observe(e)}renderer=null;orbit;gl;resolution=new lr;fov;changedAt=performance.now();nextRow=0;previewed=!1;refreshes=0;pictures=0;playStart=null;editTime=null;flight=null;distances=null;onFrame=null;edits=void 0;showsEdits=!0;pathEdits=null;canPlay=!1;async run(){const{files:e,background:t}=this.header;this.drawFrames();const{kind:s,source:n}=await ur(await xe("field",e.field)),i=this.renderer=dr(s,this.gl);i.background=t??[1,1,1],i.edited=this.showsEdits;let o;await i.load(n,{openBeside:gt,onDetails:()=>this.refresh(),onCoarse:(a,c)=>this.say(`There is no room for the details of ${a} of ${c} parts.`),onFailure:a=>this.say(a),onArrival:a=>this.progressed(Math.min(.99,a/e.field.bytes)),onLevel:(a,c)=>{this.say(a<c?"Loading detail …":""),o??=this.loadEdits(i),this.invalidate()}}),await o,e.path&&(this.pathEdits=await Pr(await Et(await xe("path",e.path)))),this.canPlay=this.header.path!==null,this.progressed(1)}async loadEdits(e){const{files:t}=this.header,s=t.edits&&await Et(await xe("edits",t.edits));this.edits=s?await e.readEdits(s,null):null,e.setEdits(this.edits),this.invalidate()}get whole(){return this.nextRow===null}get edited(){return this.showsEdits}set edited(e){this.showsEdits=e,this.renderer!==null&&(this.renderer.edited=e),this.invalidate()}get plays(){return this.playStart!==null}get extent(){return this.header.extent}get focal(){return .5*Math.min(this.canvas.clientWidth,this.canvas.clientHeight)/this.halfTangent}get flies(){return this.flight!==null}flyTo(e,t){this.playStart=null,this.showWholeEdits();const s=new Ee(e.c2w,this.header.up,t),{eye:n,target:i}=this.orbit;this.flight={from:{eye:n,target:i,fov_y_deg:this.fov},to:{eye:s.eye,target:s.target,fov_y_deg:e.fov_y_deg},begun:matchMedia("(prefers-reduced-motion: reduce)").matches?-1/0:performance.now(),view:e,around:t},this.invalidate()}play(e){this.playStart=e&&this.canPlay?performance.now():null,this.flight=null,this.invalidate()}home(){this.playStart=this.flight=null,this.showWholeEdits(),this.look(this.header.start)}seek(e,t){const s=e.loop?t%e.seconds:Math.min(t,e.seconds);this.pathEdits&&this.renderer?.setEdits(this.pathEdits.at(s)??this.edits??null),this.editTime=s,this.look(pr(e,s))}place({position:e,along:t}){const{path:s}=this.header;return this.editTime===null||!s||t===void 0?e:fr(t,s,this.editTime)}showWholeEdits(){this.editTime=null,this.edits!==void 0&&this.renderer?.setEdits(this.edits)}get halfTangent(){return Math.tan(this.fov*Math.PI/360)}look(e,t=this.header.center){this.orbit=new Ee(e.c2w,this.header.up,t),this.fov=e.fov_y_deg,this.invalidate()}change(e){this.playStart=this.flight=null,e(),this.invalidate()}invalidate(){this.changedAt=performance.now(),this.nextRow=0,this.previewed=!1}refresh(){this.refreshes++,this.nextRow=0}async drawFrames(){for(;;){await new Promise(e=>requestAnimationFrame(e));try{this.advance(),this.onFrame?.(),this.renderer!==null&&await this.draw(this.renderer)}catch(e){this.say(e instanceof Error?e.message:String(e));return}}}advance(){this.flight!==null&&this.advanceFlight(this.flight);const{path:e}=this.header;if(this.playStart===null||!e)return;const t=(performance.now()-this.playStart)/1e3;this.seek(e,t),!e.loop&&t>=e.seconds&&(this.playStart=null)}advanceFlight({from:e,to:t,begun:s,view:n,around:i}){const o=(performance.now()-s)/Br;if(o>=1){this.flight=null,this.look(n,i);return}const{eye:a,target:c,fov_y_deg:l}=mr(e,t,o,this.header.up);this.orbit.eye=a,this.orbit.target=c,this.fov=l,this.invalidate()}async draw(e){const{canvas:t,gl:s,resolution:n}=this;if(this.nextRow===null||e.level?.last&&this.edits===void 0)return;const i=Math.min(devicePixelRatio,Lr),[o,a]=[t.clientWidth,t.clientHeight].map(E=>Math.max(1,Math.round(E*i)));(t.width!==o||t.height!==a)&&Object.assign(t,{width:o,height:a});const c=n.scale(o,a),l=this.previewed&&performance.now()-this.changedAt>Lt||c===1,[h,d]=l?[o,a]:[o,a].map(E=>Math.max(Fr,Math.round(E*c)));this.setCamera(e,h,d);const u=l?this.nextRow:0,m=l&&e.inBands?Math.min(n.bandRows(o,a),a-u):d,{changedAt:f,refreshes:y}=this,x=performance.now()-f>Lt;if(!e.render({rows:{first:u,count:m},sorted:x}))return;const g=u+m>=d;if(g&&(e.show(o,a),this.header.hotspots&&(this.distances=e.distances(Ir)),this.pictures++),n.record(h*m,await hr(s)),this.changedAt===f){if(this.previewed=!0,this.refreshes!==y)return void(this.nextRow=0);l&&(this.nextRow=g?e.inOrder?null:0:u+m)}}setCamera(e,t,s){const n=.5*Math.min(t,s)/this.halfTangent,{c2w:i}=this.orbit;e.setSize(t,s),e.setCamera({c2w:i,width:t,height:s,fx:n,fy:n,cx:t/2,cy:s/2})}}async function Pr(r){return Tt(new Uint8Array(r))===Nt?await Re.read(r):await Te.read(r)}window.cagefieldViewer={FieldRenderer:Ge,readEdits:Ce,SplatRenderer:ft,readSplatEdits:Qe,readEditsBeside:et,take:rr};function _(r){const e=document.querySelector(r);if(!e)throw new Error(`the page has no ${r}`);return e}async function Xr(r){const e=_(".message"),t=_(".arrived"),s=n=>void(e.textContent=n);try{const n=new zr(_("canvas"),r,s,h=>{t.value=h,t.hidden=h>=1});window.cagefieldViewer.viewer=n;const[i,o,a]=[_(".compare"),_(".play"),_(".home")];i.hidden=!r.files.edits,i.onclick=()=>n.edited=!n.edited,o.onclick=()=>n.play(!n.plays),a.onclick=()=>n.home();const c=Gr(n,r),l=_(".scale");n.onFrame=()=>{c.arrange(),r.meters_per_unit!==void 0&&sr(l,n.orbit,n.focal,r.meters_per_unit)},setInterval(()=>{o.hidden=!n.canPlay,o.textContent=n.plays?"Stop":"Play",i.textContent=n.edited?"Show before":"Show after"},100),window.addEventListener("keydown",({key:h,target:d})=>{h==="b"&&i.click(),h===" "&&!(d instanceof HTMLButtonElement)&&o.click(),h==="h"&&a.click(),h==="ArrowRight"&&c.step(1),h==="ArrowLeft"&&c.step(-1),h==="Escape"&&c.close()}),await n.run()}catch(n){t.hidden=!0,s(n instanceof Error?n.message:String(n))}}function Gr(r,e){const t=_(".card"),s=new Js(r,e.hotspots??[],_(".hotspots"),t);window.cagefieldViewer.hotspots=s;for(const[n,i]of[[".previous",-1],[".next",1]]){const o=_(n);o.hidden=s.hotspots.length===0,o.onclick=()=>s.step(i)}return _(".close").onclick=()=>s.close(),s}const Ft=document.getElementById("scene");Ft&&Xr(JSON.parse(Ft.textContent))})();
